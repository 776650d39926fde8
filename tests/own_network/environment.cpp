// Makes the tests of a GoogleTest program, into which this file is linked, run in a network of their own.
#include <gtest/gtest.h>

#include "tests/own_network/own_network.hpp"

namespace {

class OwnNetwork final : public testing::Environment {
 public:
  void SetUp() override { sonar::tests::enter_own_network(); }
};

[[maybe_unused]] const testing::Environment* const added = testing::AddGlobalTestEnvironment(new OwnNetwork);

}  // namespace
