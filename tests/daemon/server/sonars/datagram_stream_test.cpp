// Tests a silent UDP host: when the daemon sends a probe to its computer, and when the host counts as disconnected.
#include "daemon/server/sonars/datagram_port.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "tests/daemon/server/loopback.hpp"
#include "tests/daemon/server/sonars/session_parent.hpp"

namespace sonar::testing_daemon::datagram_stream_test {
namespace {

constexpr milliseconds limit{400};

struct SilentHost : ::testing::Test, QuietParent {
  SilentHost() { stream->start(); }
  ~SilentHost() override {
    stream->finish("the test is over");
    run_until([] { return false; }, milliseconds(1));
  }
  std::optional<milliseconds> longest_silence(ConnectionId) const override { return limit; }
  void look_for_host(ConnectionId) override {
    ++looks;
    if (answered_look != 0 && looks % answered_look == 0) stream->heard();
  }
  template <class Condition>
  void run_until(Condition is_met, milliseconds longest = patience) {
    const auto end = Steady::now() + longest;
    while (!is_met() && Steady::now() < end) {
      io.restart();
      io.run_for(milliseconds(10));
    }
  }

  asio::io_context io;
  udp::socket socket{io, udp::v4()};
  std::shared_ptr<DatagramStream> stream = std::make_shared<DatagramStream>(*this, socket, 1, std::chrono::nanoseconds(0));
  int looks = 0;
  int answered_look = 0;  // n: the host's computer answers every nth probe; 0: it answers none
};

TEST_F(SilentHost, IsGivenUpAfterTheLimitWhenNothingAnswers) {
  const auto began = Steady::now();
  run_until([&] { return !why.empty(); });
  EXPECT_EQ(why, "silent for 0 s");
  EXPECT_GE(Steady::now() - began, limit);
  EXPECT_EQ(looks, 4);
}

TEST_F(SilentHost, StaysWhenAnAnswerOfItsComputerIsLost) {
  answered_look = 2;
  run_until([&] { return looks >= 6 || !why.empty(); });
  EXPECT_EQ(why, "");
  EXPECT_GE(looks, 6);
}

TEST_F(SilentHost, IsProbedAfterTheDaemonWasBlocked) {
  answered_look = 1;
  asio::post(io, [] { std::this_thread::sleep_for(3 * limit); });
  run_until([&] { return looks >= 2 || !why.empty(); });
  EXPECT_EQ(why, "");
  EXPECT_GE(looks, 2);
}

}  // namespace
}  // namespace sonar::testing_daemon::datagram_stream_test
