// The tables in the folder's README are those of the code.
#include <fstream>

#include "protocol/oculus/options.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::testing {
namespace {

std::string readme() {
  std::ifstream file(std::string(SONARD_SOURCE_DIR) + "/protocol/oculus/README.md");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

template <class M>
void expect_table() {
  EXPECT_NE(readme().find("\n\n" + wire::offset_table<M>() + "\n"), std::string::npos)
      << "README.md lacks this table, paste it:\n"
      << wire::offset_table<M>();
}

TEST(Readme, HasEveryMessageTable) {
  expect_table<MessageHeader>();
  expect_table<FireMessageV1>();
  expect_table<FireMessageV2>();
  expect_table<StatusMessage>();
  expect_table<PingResultV1>();
  expect_table<PingResultV2>();
  expect_table<UserConfigMessage>();
}

TEST(Readme, HasTheOptionTable) {
  EXPECT_NE(readme().find(options_table()), std::string::npos) << "README.md lacks this table, paste it:\n" << options_table();
}

}  // namespace
}  // namespace sonar::oculus::testing
