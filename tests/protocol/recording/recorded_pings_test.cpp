// Tests that decode_next() passes the messages and the times of a recording to a host.
#include "protocol/recording/recording.hpp"

#include <gmock/gmock.h>

namespace sonar::recording::recorded_pings_test {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Decodes every message as a ping numbered with its size. The first tick is 100 ms after the first message and gives ping 0.
class CountingHost final : public protocol::Host {
 public:
  protocol::HostActions on_open(std::span<const std::uint16_t>, Time) override { return {}; }
  protocol::HostActions on_bytes(std::size_t port, BytesView received, Time now) override {
    EXPECT_EQ(port, 0u);
    if (!tick_) tick_ = now + milliseconds(100);
    protocol::HostPing ping;
    ping.facts.number = static_cast<std::uint32_t>(received.size());
    return {protocol::HostSend{}, ping};
  }
  protocol::HostActions on_tick(Time now) override {
    ticked_at.push_back(now);
    tick_ = Time(std::chrono::hours(1));
    return {protocol::HostPing{}};
  }
  std::optional<Time> next_tick() const override { return tick_; }
  std::string about() const override { return "a counting host"; }

  std::vector<Time> ticked_at;

 private:
  std::optional<Time> tick_;
};

constexpr std::array<protocol::HostPort, 1> ports{{{protocol::HostPort::Kind::tcp, 4001}}};

TEST(DecodeNext, TicksComeBeforeALaterMessageAndAtTheEnd) {
  protocol::Make make;
  make.ports = ports;
  CountingHost host;
  const auto decoded = [&](int ms, std::size_t size, Origin from = Origin::device) {
    const RecordedMessage message{Time(milliseconds(ms)), from, Carrier::stream, Bytes(size)};
    std::vector<std::pair<int, std::uint32_t>> pings;
    for (const RecordedPing& one : decode_next(host, make, &message))
      pings.emplace_back(std::chrono::duration_cast<milliseconds>(one.at.time_since_epoch()).count(), one.ping.facts.number);
    return pings;
  };
  using Ping = std::pair<int, std::uint32_t>;
  EXPECT_THAT(decoded(1000, 5), ElementsAre(Ping(1000, 5)));
  EXPECT_THAT(decoded(1099, 6), ElementsAre(Ping(1099, 6)));
  EXPECT_THAT(decoded(1105, 7), ElementsAre(Ping(1105, 0), Ping(1105, 7))) << "the tick was due";
  EXPECT_THAT(decoded(1200, 8, Origin::client), IsEmpty()) << "a message of a client is no ping";
  const auto last = decode_next(host, make, nullptr);
  ASSERT_EQ(last.size(), 1u) << "a ping that waits is complete at the end";
  EXPECT_EQ(last.front().at, Time(std::chrono::hours(1)));
  EXPECT_THAT(host.ticked_at, ElementsAre(Time(milliseconds(1105)), Time(std::chrono::hours(1))));
}

TEST(DecodeNext, TimePassesWithMessagesOfClients) {
  protocol::Make make;
  make.ports = ports;
  CountingHost host;
  const RecordedMessage first{Time(milliseconds(1000)), Origin::device, Carrier::stream, Bytes(5)};
  const RecordedMessage request{Time(milliseconds(1200)), Origin::client, Carrier::stream, Bytes(5)};
  EXPECT_EQ(decode_next(host, make, &first).size(), 1u);
  EXPECT_EQ(decode_next(host, make, &request).size(), 1u) << "only the ping of the tick";
}

}  // namespace
}  // namespace sonar::recording::recorded_pings_test
