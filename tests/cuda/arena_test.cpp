// Tests the memory of a batch: each byte that is copied back was written or cleared before, also between the pieces.
#include "cuda/arena.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

namespace sonar::cuda {
namespace {

TEST(Arena, ClearsMemoryForResults) {
  const auto machine = make_host_loops(LoopOrder::backwards);  // its memory begins as 0xFF
  Arena results(*machine, Arena::Where::both, 4096, 0);
  const auto few = results.allocate<std::uint8_t>(8), more = results.allocate<std::uint8_t>(8);
  ASSERT_EQ(more.host - few.host, 256);
  few.device[0] = 1;
  std::fill_n(few.host, 256 + 8, std::uint8_t{2});
  results.download(0);
  EXPECT_EQ(few.host[0], 1);
  EXPECT_EQ(std::count(few.host + 1, more.host + 8, 0), 256 + 7);
}

}  // namespace
}  // namespace sonar::cuda
