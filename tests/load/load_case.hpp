// Common parts of the load tests: their duration, and the storage of their figures.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <string>

#include "core/text/format.hpp"
#include "daemon/emulator/connections/outbox.hpp"
#include "tests/is_sanitized.hpp"
#include "tests/load/ping_reader.hpp"
#include "tests/reliability/record.hpp"

namespace sonar::load {

/// --quick sets this: each test takes a few seconds, with the same assertions apart from those that hold only on a quiet machine.
inline bool quick = false;
inline constexpr std::chrono::seconds patience{20};          // time limit of every expected event
inline constexpr bool memory_is_ours = !test::is_sanitized;  // a sanitizer keeps freed memory

using text::format;

/// Prints the figure and, in a full run, keeps it for the table of reliability.
inline void keep(const std::string& item, const std::string& figure, const std::string& bound, bool passed) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::printf("  %-18s %s (%s)\n", item.c_str(), figure.c_str(), bound.c_str());
  std::fflush(stdout);
  if (quick) return;
  const std::string command = std::string("build/release/tests/load/load_test --gtest_filter=Load.") + test->name();
  EXPECT_TRUE(test::record_reliability({item, figure, bound, passed, command}));
}

/// The figures of a sonar must balance after it has stopped, for any behaviour of its clients.
inline void expect_accounts_balance(const DeviceFigures& f) {
  EXPECT_LE(f.pings + f.skipped_ticks, f.ticks);
  EXPECT_LE(f.ticks, f.pings + f.skipped_ticks + 1) << "a ping may be in progress at the stop";
  EXPECT_EQ(f.waiting, 0u);
  EXPECT_EQ(f.offered, f.sent + f.dropped);
  std::uint64_t by_reason = 0;
  for (const std::uint64_t drops : f.dropped_by) by_reason += drops;
  EXPECT_EQ(f.dropped, by_reason);
  EXPECT_EQ(f.latency.count(), f.sent);
}

template <class Done>
bool eventually(Done&& done, std::chrono::milliseconds within = patience) {
  const auto deadline = Steady::now() + within;
  while (!done()) {
    if (Steady::now() > deadline) return false;
    timespec pause{0, 5'000'000};
    nanosleep(&pause, nullptr);
  }
  return true;
}

}  // namespace sonar::load
