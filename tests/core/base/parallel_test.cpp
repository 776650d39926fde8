// The compute pool: it processes every item exactly once, worker numbers are in range, and it can be used repeatedly, with any
// number of threads.
#include "core/base/parallel.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <new>
#include <system_error>
#include <vector>

#include "core/base/memory_left.hpp"
#include "tests/memory_limit.hpp"

namespace sonar {
namespace {

class ParallelPool : public testing::TestWithParam<int> {};

TEST_P(ParallelPool, RunsEveryItemOnce) {
  Parallel pool(GetParam());
  EXPECT_EQ(pool.threads(), GetParam());
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{10000}}) {
    std::vector<std::atomic<int>> seen(count);
    std::atomic<bool> worker_in_range = true;
    pool.for_each(count, [&](std::size_t item, int worker) {
      ++seen[item];
      if (worker < 0 || worker >= pool.threads()) worker_in_range = false;
    });
    for (const auto& n : seen) ASSERT_EQ(n, 1);
    EXPECT_TRUE(worker_in_range);
  }
}

TEST_P(ParallelPool, NoWorkerIsInTwoItemsAtOnce) {
  Parallel pool(GetParam());
  std::vector<std::atomic<int>> inside(static_cast<std::size_t>(pool.threads()));
  std::atomic<bool> overlap = false;
  pool.for_each(2000, [&](std::size_t, int worker) {
    const auto w = static_cast<std::size_t>(worker);
    if (inside[w].fetch_add(1) != 0) overlap = true;
    inside[w].fetch_sub(1);
  });
  EXPECT_FALSE(overlap);
}

TEST_P(ParallelPool, RunsManySmallRounds) {
  Parallel pool(GetParam());
  std::vector<int> sum(64);
  for (int round = 0; round < 500; ++round) {
    pool.for_each(sum.size(), [&](std::size_t item, int) { ++sum[item]; });
  }
  for (const int n : sum) EXPECT_EQ(n, 500);  // for_each returns only when all items are done and visible
}

TEST_P(ParallelPool, AnExceptionEndsTheLoopAndReachesTheCaller) {
  Parallel pool(GetParam());
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> inside = 0;
    const auto all = [&] {
      pool.for_each(1000, [&](std::size_t item, int) {
        ++inside;
        if (item % 100 == 7) {
          --inside;
          throw std::bad_alloc();
        }
        --inside;
      });
    };
    EXPECT_THROW(all(), std::bad_alloc);
    EXPECT_EQ(inside, 0) << "no worker is left in the loop";
    std::atomic<int> seen = 0;
    pool.for_each(100, [&](std::size_t, int) { ++seen; });
    EXPECT_EQ(seen, 100) << "and the next loop is whole";
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelPool, testing::Values(1, 2, 4), testing::PrintToStringParamName());

/// Bytes of the stack that a new thread gets.
rlim_t stack_bytes_of_a_thread() {
  pthread_attr_t attributes;
  std::size_t bytes = 0;
  if (::pthread_getattr_default_np(&attributes) != 0) return 0;
  ::pthread_attr_getstacksize(&attributes, &bytes);
  ::pthread_attr_destroy(&attributes);
  return bytes;
}

// A child process whose limit of addresses leaves room for the stacks of a few workers, but not of all.
TEST(ParallelPoolLimits, AWorkerThatCannotStartIsAnException) {
  if (!test::memory_is_limited()) GTEST_SKIP() << "sanitizers and emulated processors keep no limit of addresses";
  const pid_t child = ::fork();
  if (child == 0) {
    const rlim_t bytes = address_space_bytes().value() + 5 * stack_bytes_of_a_thread();
    const rlimit limit{bytes, bytes};
    if (::setrlimit(RLIMIT_AS, &limit) != 0) ::_exit(2);
    try {
      const Parallel many(64);
    } catch (const std::system_error&) {
      ::_exit(0);
    }
    ::_exit(1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace sonar
