// Measures the work of a reader of .svlog files by the bytes that it allocates. It is a separate program, because it replaces
// operator new.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping_log.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace {

thread_local std::uint64_t allocated_bytes = 0;

}  // namespace

// Counts every allocation of this program. (GCC wrongly reports the inlined pair as a mismatch.)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) {
  allocated_bytes += size;
  if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace sonar::recording {
namespace {

/// Returns a log of two messages: the description of the file, and the temperature.
Bytes short_log() {
  Bytes file;
  const auto writer = write_ping_log(sink_into(file));
  const Bytes sent = ping::framed_message(ping::Id::water_stats, 0, ping::WaterStats{12, 1.5f});
  EXPECT_TRUE(writer->write({tests::start, Origin::device, Carrier::stream, sent}));
  EXPECT_TRUE(writer->close());
  return file;
}

/// Each start of a frame states the longest payload. A reader that copied or summed it for each would need hours for a large
/// file.
TEST(PingLogCost, TheWorkForFalseStartsIsProportionalToTheFile) {
  std::vector<std::uint64_t> costs;
  for (const std::size_t starts : {std::size_t{1} << 15, std::size_t{1} << 17}) {
    Bytes file = short_log();
    const std::size_t first_start = file.size();
    for (std::size_t i = 0; i < starts; ++i)
      for (const int b : {0x42, 0x52, 0xff, 0xff}) file.push_back(static_cast<std::byte>(b));
    const Bytes last = ping::framed_message(ping::Id::water_stats, 0, ping::WaterStats{12, 1.5f});
    file.insert(file.end(), last.begin(), last.end());
    const auto reader = read_ping_log(source_from("f", file));
    const std::uint64_t before = allocated_bytes;
    std::size_t messages = 0;
    while (reader->next()) ++messages;
    costs.push_back(allocated_bytes - before);
    EXPECT_EQ(messages, 2u);
    EXPECT_EQ(reader->damage()->text, "f: bytes " + std::to_string(first_start) + " to " +
                                          std::to_string(file.size() - last.size() - 1) + " are not a whole frame");
  }
  EXPECT_LT(costs[1], 5 * costs[0]);
  EXPECT_LT(costs[1], 16u * (std::size_t{1} << 19));
}

}  // namespace
}  // namespace sonar::recording
