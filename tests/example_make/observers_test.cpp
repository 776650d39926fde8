// Tests that an observer of any make gets every ping that a client requests, although the observer requests nothing.
#include <gtest/gtest.h>

#include "daemon/config/products.hpp"
#include "tests/example_make/host_link.hpp"

namespace sonar::observers_test {
namespace {

using namespace std::chrono_literals;

class Observers : public testing::TestWithParam<protocol::Make> {};
INSTANTIATE_TEST_SUITE_P(OfEveryMake, Observers, testing::ValuesIn(protocol::makes().begin(), protocol::makes().end()),
                         [](const auto& of) { return std::string(of.param.name()); });

TEST_P(Observers, GetEveryPingOfTheDriver) {
  if (default_max_observers(*GetParam().device) == 0) return;
  host_link::Link link(GetParam(), 5.0);
  ASSERT_TRUE(link.gets_ping_within(20s));
  link.observe();
  const std::size_t before = link.pings;
  link.run(4s);
  EXPECT_GT(link.pings, before + 5);
  EXPECT_EQ(link.observed, link.pings - before);
}

}  // namespace
}  // namespace sonar::observers_test
