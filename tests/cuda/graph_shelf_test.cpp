// Tests how a repeated launch is found, even if the number of cells differs a little, and which graph is dropped.
#include "cuda/graph_shelf.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace sonar::cuda {
namespace {

TEST(BlocksOfALaunch, AreEnoughAndAtMostAnEighthOrSevenTooMany) {
  EXPECT_EQ(blocks_for(0), 0u);
  EXPECT_EQ(blocks_for(1), 8u);
  std::uint32_t before = 0;
  for (std::uint64_t n = 1; n < std::uint64_t{1} << 32; n += 1 + n / 97) {
    const std::uint32_t blocks = blocks_for(static_cast<std::uint32_t>(n));
    const std::uint64_t needed = (n + threads_a_block - 1) / threads_a_block;
    EXPECT_GE(blocks, needed) << n;
    EXPECT_LE(8 * (blocks - needed), std::max<std::uint64_t>(needed, 8 * 7)) << n;
    EXPECT_GE(blocks, before) << n;
    before = blocks;
  }
}

TEST(BlocksOfALaunch, NeverReachAnIndexBeyond32Bits) {
  for (const std::uint32_t n : {0xFFFFFFFFu, 0xFFFFFF00u, 0xF0000001u})
    EXPECT_EQ(blocks_for(n) * std::uint64_t{threads_a_block}, std::uint64_t{1} << 32) << n;
}

TEST(BlocksOfALaunch, AreTheSameForSimilarSizes) {
  EXPECT_EQ(blocks_for(170000), blocks_for(170900));
  for (const std::uint32_t points : {1u, 2u}) EXPECT_EQ(blocks_for(512 * points), blocks_for(1)) << points << " points";
}

Launch launch_of(std::int32_t pings, std::uint32_t slots) {
  Launch l;
  l.pings = pings;
  for (std::uint32_t& n : l.largest) n = slots;
  return l;
}

TEST(GraphShelf, FindsARepeatedLaunch) {
  GraphShelf<const char*> shelf;
  const char* dropped = nullptr;
  EXPECT_EQ(shelf.look_up(GraphKey(launch_of(8, 170000)), dropped).seen, 1);
  EXPECT_EQ(shelf.look_up(GraphKey(launch_of(8, 170900)), dropped).seen, 2);
  EXPECT_EQ(shelf.look_up(GraphKey(launch_of(7, 170000)), dropped).seen, 1);
  PingView elsewhere;
  Launch moved = launch_of(8, 170000);
  moved.views = &elsewhere;
  EXPECT_EQ(shelf.look_up(GraphKey(moved), dropped).seen, 1);
  EXPECT_EQ(shelf.look_up(GraphKey(launch_of(8, 170000)), dropped).seen, 3);
  Launch half = launch_of(8, 170000);
  half.to = 4;
  EXPECT_EQ(shelf.look_up(GraphKey(half), dropped).seen, 1);
}

TEST(GraphShelf, DropsTheLeastRecentlyUsedGraph) {
  GraphShelf<const char*> shelf;
  const char* dropped = nullptr;
  shelf.look_up(GraphKey(launch_of(100, 1)), dropped).graph = "first";
  shelf.look_up(GraphKey(launch_of(101, 1)), dropped).graph = "second";
  for (int i = 2; i < static_cast<int>(shelf.room); ++i) shelf.look_up(GraphKey(launch_of(100 + i, 1)), dropped);
  EXPECT_STREQ(shelf.look_up(GraphKey(launch_of(100, 1)), dropped).graph, "first");
  EXPECT_EQ(dropped, nullptr);
  EXPECT_EQ(shelf.look_up(GraphKey(launch_of(99, 1)), dropped).graph, nullptr);
  EXPECT_STREQ(dropped, "second");
  EXPECT_EQ(shelf.entries().size(), shelf.room);
  EXPECT_STREQ(shelf.look_up(GraphKey(launch_of(100, 1)), dropped).graph, "first");
}

}  // namespace
}  // namespace sonar::cuda
