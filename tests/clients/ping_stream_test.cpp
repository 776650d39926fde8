// A stream of pings whose sonar falls silent, sends an error, or leaves a recording without space.
#include "clients/sonarctl/ping_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "clients/sonarctl/source.hpp"
#include "tests/clients/bound_socket.hpp"
#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::clients::ping_stream_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

/// A DVL with settings of another driver, and a stream that has changed them.
class Dvl {
 public:
  Dvl() {
    ::listen(listener_.fd(), 16);
    Wanted wanted;
    wanted.settings.range_m = 5;
    auto opened = PingStream::open({"127.0.0.2", ntohs(own_address(listener_).sin_port)}, find_make("dvl"), wanted, 20s);
    EXPECT_TRUE(opened) << (opened ? "" : opened.error().text);
    if (!opened) return;
    stream.emplace(*std::move(opened));
    client_.emplace(::accept4(listener_.fd(), nullptr, nullptr, SOCK_CLOEXEC));
    answer("auto");
    hear("set_config");
  }
  void say(std::string_view line) { EXPECT_TRUE(write_all(*client_, bytes_of(line))); }
  /// Answers get_config.
  void answer(const std::string& range_mode) {
    say(R"({"response_to":"get_config","success":true,"error_message":"","type":"response","format":"json_v3.3",)"
        R"("result":{"acoustic_enabled":true,"range_mode":")" +
        range_mode + "\"}}\r\n");
  }
  /// Runs the stream until the device has received `text`. Returns all that it has received since the last call.
  std::string hear(std::string_view text) {
    std::string heard;
    for (const auto until = std::chrono::steady_clock::now() + 20s; std::chrono::steady_clock::now() < until;) {
      if (stream) stream->next(1ms);
      std::array<std::byte, 4096> chunk;
      const Read read = read_some(*client_, chunk, 1ms);
      for (std::size_t i = 0; i < read.size; ++i) heard += std::to_integer<char>(chunk[i]);
      if (heard.find(text) != std::string::npos) return heard;
    }
    ADD_FAILURE() << "the device has not received " << text << " but " << heard;
    return heard;
  }

  void leave() { client_.reset(); }

  std::optional<PingStream> stream;

 private:
  Socket listener_ = bound_socket("127.0.0.2", SOCK_STREAM, 0);
  std::optional<Socket> client_;
};

TEST(PingStream, ASilentSonarDelaysTheNextConnectionLittle) {
  Dvl dvl;
  ASSERT_TRUE(dvl.stream);
  Outage outage;
  outage.begins(*dvl.stream);
  const auto begin = std::chrono::steady_clock::now();
  dvl.stream.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2500ms) << "3 s is the wait for the answer of a sonar that is there";
}

TEST(PingStream, AnErrorOfTheSonarIsNotReportedAsABrokenConnection) {
  const SocketServer sonar("127.0.0.2", 0, [](const Socket& client) {
    auto device = blueview::test::device();
    const auto dialogue = blueview::vendor().converse(blueview::vendor().ports().front(), device, Time{});
    std::array<std::byte, 4096> chunk;
    for (int requests = 1;; ++requests) {
      const Read read = read_some(client, chunk, 20s);
      if (read.what != Wait::data) return;
      if (requests > 1) {  // after the greeting, the request for a ping
        static_cast<void>(write_all(client, blueview::make_error(2, blueview::Code::timeout, "no ping in the time given")));
        continue;
      }
      for (const wire::Bytes& reply : dialogue->on_bytes(std::span<const std::byte>(chunk).first(read.size), Time{}).replies)
        static_cast<void>(write_all(client, reply));
    }
  });
  auto stream = PingStream::open(*parse_endpoint(sonar.at(), {}), find_make("blueview"), {}, 20s);
  ASSERT_TRUE(stream) << stream.error().text;
  PingStream::Item item;
  for (const auto until = std::chrono::steady_clock::now() + 20s;
       item.what != Wait::closed && std::chrono::steady_clock::now() < until;)
    item = stream->next(100ms);
  ASSERT_EQ(item.what, Wait::closed);
  const Error why = closed(item, 3);
  EXPECT_EQ(why.kind, ErrorKind::io);
  EXPECT_THAT(why.text, testing::StartsWith("tcp " + sonar.at() + " sends no ping: no ping in the time given"));
}

TEST(PingStream, AFailedRecordingDoesNotKeepTheSettingsFromBeingPutBack) {
  Dvl dvl;
  ASSERT_TRUE(dvl.stream);
  ASSERT_TRUE(dvl.stream->record_to("/dev/full"));
  dvl.answer("0<=2");  // the settings of the stream, which cannot be recorded
  PingStream::Item item;
  for (const auto until = std::chrono::steady_clock::now() + 20s;
       item.what != Wait::closed && std::chrono::steady_clock::now() < until;)
    item = dvl.stream->next(100ms);
  ASSERT_TRUE(item.is_not_recorded) << item.error;
  auto last = std::make_unique<PingStream>(*std::move(dvl.stream));
  dvl.stream.reset();
  const auto left = std::async(std::launch::async, [&last] { last.reset(); });
  dvl.hear("get_config");
  dvl.answer("0<=2");
  EXPECT_THAT(dvl.hear("set_config"), HasSubstr(R"("range_mode":"auto")"));
  dvl.leave();
}

}  // namespace
}  // namespace sonar::clients::ping_stream_test
