// Tests the host and the emulated sonar of every make in virtual time, during every kind of fault that affects such a sonar: the
// host must accept any bytes, and pings must arrive again after the fault.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/config/fault_support.hpp"
#include "tests/example_make/host_link.hpp"
#include "tests/is_sanitized.hpp"

namespace sonar::faults_test {
namespace {

using namespace std::chrono_literals;

class HostsAndFaults : public testing::TestWithParam<protocol::Make> {};
INSTANTIATE_TEST_SUITE_P(OfEveryMake, HostsAndFaults, testing::ValuesIn(protocol::makes().begin(), protocol::makes().end()),
                         [](const auto& of) { return std::string(of.param.name()); });

/// Few pings under sanitizers, because each ping reads and alters the same data.
constexpr std::optional<double> rate_hz = test::is_sanitized ? std::optional(2.0) : std::nullopt;

TEST_P(HostsAndFaults, PingsComeAgainAfterEveryFault) {
  const protocol::Make& make = GetParam();
  int tried = 0;
  for (const FaultKind& kind : fault_kinds()) {
    if (!why_without_effect(kind, *make.device).empty()) continue;
    SCOPED_TRACE(std::string(kind.code) + " " + std::string(kind.name));
    host_link::Link link(make, rate_hz);
    ASSERT_TRUE(link.gets_ping_within(20s));
    if (!link.add(kind)) continue;
    ++tried;
    link.run(test::is_sanitized ? 2500ms : 5000ms);
    link.end_faults();
    EXPECT_TRUE(link.gets_ping_within(60s));
  }
  EXPECT_GT(tried, 20);
}

}  // namespace
}  // namespace sonar::faults_test
