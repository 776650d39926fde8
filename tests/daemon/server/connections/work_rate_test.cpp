// The limit of the work for an address, in virtual time. The limit does not depend on what the address sends or how often it
// connects.
#include "daemon/server/connections/port_guard.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "daemon/server/view/view_connection.hpp"

namespace sonar {
namespace {

using Steady = WorkRate::Steady;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::size_t per_s = 1 << 20;

/// Returns how often work of this cost is done within 5 s for a client that always requests more.
std::size_t done_in_5_s(std::size_t cost) {
  WorkRate rate;
  const auto begin = Steady::time_point(std::chrono::hours(5));
  std::size_t done = 0;
  for (auto now = begin; now < begin + seconds(5); ++done) now += rate.pause_after("a", cost, per_s, now) + Steady::duration(1);
  return done;
}

TEST(WorkRate, WorkBesideBytesIsCounted) {
  EXPECT_LT(done_in_5_s(work::of_request + 60 + 300), 7300u) << "small requests: 70,000 without the count";
  EXPECT_LT(done_in_5_s(work::of_request + 60 + 5000), 1200u) << "status";
  EXPECT_LT(done_in_5_s(work::of_request + 60 + 177000), 40u) << "the page";
  EXPECT_LT(done_in_5_s(work::of_connection + work::of_request + work::of_upgrade + 200), 190u)
      << "handshakes: 3866 without the count";
}

TEST(WorkRate, AllConnectionsOfAnAddressShareOneLimit) {
  WorkRate rate;
  const auto now = Steady::time_point(std::chrono::hours(5));
  for (int i = 0; i < 100; ++i) rate.pause_after("flood", per_s, per_s, now);
  EXPECT_EQ(std::chrono::round<milliseconds>(rate.pause_after("flood", 0, per_s, now)), seconds(1))
      << "a new connection of this address waits, too, but a second at most";
  EXPECT_EQ(rate.pause_after("flood", 0, per_s, now + seconds(1)).count(), 0);
  EXPECT_EQ(rate.pause_after("honest", 10000, per_s, now).count(), 0);
}

TEST(WorkRate, WaitingConnectionsAreServedOneAfterTheOther) {
  WorkRate rate;
  const auto now = Steady::time_point(std::chrono::hours(5));
  rate.pause_after("a", per_s, per_s, now);
  const auto first = rate.pause_after("a", per_s / 10, per_s, now), second = rate.pause_after("a", per_s / 10, per_s, now);
  EXPECT_EQ(std::chrono::round<milliseconds>(first), milliseconds(100));
  EXPECT_EQ(std::chrono::round<milliseconds>(second), milliseconds(200));
}

TEST(WorkRate, TheNumberOfAddressesIsLimited) {
  WorkRate rate;
  auto now = Steady::time_point(std::chrono::hours(5));
  rate.pause_after("flood", 10 * per_s, per_s, now);
  for (std::size_t i = 0; i < 3 * WorkRate::most_addresses; ++i) {
    now += Steady::duration(1);
    rate.pause_after(std::to_string(i), 1, per_s, now);
    EXPECT_GT(rate.pause_after("flood", 0, per_s, now).count(), 0) << "an address that was used recently is forgotten";
  }
}

std::vector<std::byte> frame(unsigned first, std::size_t payload) {
  std::vector<std::byte> bytes{std::byte(first)};
  if (payload < 126) {
    bytes.push_back(std::byte(0x80 | payload));
  } else if (payload < 65536) {
    bytes.insert(bytes.end(), {std::byte(0x80 | 126), std::byte(payload >> 8), std::byte(payload & 255)});
  } else {
    bytes.push_back(std::byte(0x80 | 127));
    for (int shift = 56; shift >= 0; shift -= 8) bytes.push_back(std::byte(std::uint64_t{payload} >> shift & 255));
  }
  bytes.insert(bytes.end(), 4 + payload, std::byte{0x89});  // a mask and a payload that look like heads of pings
  return bytes;
}

TEST(PortGuard, ConnectionsOfOneAddressAreLimitedAndThoseOfOthersAreNot) {
  PortGuard guard;
  auto now = Steady::time_point(std::chrono::hours(5));
  std::size_t taken = 0;
  const auto is_taken = [&](const char* address, Steady::time_point at) {
    return guard.pause_before_connection(address, per_s, at).count() == 0;
  };
  for (int i = 0; i < 50000; ++i, now += milliseconds(1) / 10) taken += is_taken("storm", now);
  EXPECT_EQ(PortGuard::connections_per_s(per_s), 102u);
  EXPECT_GE(taken, 102u);
  EXPECT_LE(taken, 6 * 102u) << "of 10,000 connections per second for 5 s";
  EXPECT_TRUE(is_taken("driver", now));
  EXPECT_LE(guard.pause_before_connection("storm", per_s, now), seconds(1));
  EXPECT_TRUE(is_taken("storm", now + seconds(2))) << "a driver at the same address, 2 s later";
}

TEST(PortGuard, DatagramsAreLimitedByWorkAndBySocket) {
  PortGuard guard;
  DatagramRate rate(2048);
  const auto begin = Steady::time_point(std::chrono::hours(5));
  std::size_t read = 0, taken = 0;
  for (auto now = begin; now < begin + seconds(5); now += milliseconds(1) / 100, ++read) {  // 100,000 per second
    const bool takes = guard.takes_datagram("flood", 12, per_s, now);
    if (takes) guard.count("flood", work::of_reaction, per_s, now);
    taken += takes;
    now += rate.pause_after(takes, now);
  }
  EXPECT_LE(taken, 6 * per_s / (12 + work::of_datagram + work::of_reaction));
  EXPECT_LE(read, std::size_t{6} * 16384);
  EXPECT_TRUE(guard.takes_datagram("host", 12, per_s, begin + seconds(5)));
}

TEST(FrameWork, CountsFramesAtEverySplit) {
  constexpr unsigned text = 0x81, begun = 0x01, goes_on = 0x00, ping = 0x89, pong = 0x8A;
  std::vector<std::byte> all;
  std::size_t expected = 0;
  for (const auto& [first, payload] :
       {std::pair(text, std::size_t{5}), std::pair(begun, std::size_t{0}), std::pair(goes_on, std::size_t{0}),
        std::pair(ping, std::size_t{0}), std::pair(pong, std::size_t{125}), std::pair(text, std::size_t{126}),
        std::pair(text, std::size_t{70000})}) {
    const auto one = frame(first, payload);
    all.insert(all.end(), one.begin(), one.end());
    expected += one.size() + (first == ping || first == pong ? work::of_control_frame : work::of_frame);
  }
  for (const std::size_t piece :
       {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{7}, std::size_t{4096}, all.size()}) {
    FrameWork counted;
    std::size_t work = 0;
    for (std::size_t at = 0; at < all.size(); at += piece)
      work += counted.of(std::span(all).subspan(at, std::min(piece, all.size() - at)));
    EXPECT_EQ(work, expected) << "in pieces of " << piece;
  }
}

}  // namespace
}  // namespace sonar
