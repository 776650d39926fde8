// docs/faults.md names every trouble (a named group of faults) with the duration that the code has.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>

#include "core/text/format.hpp"
#include "protocol/fault_kinds.hpp"

namespace sonar {
namespace {

TEST(FaultDocs, NamesEveryTroubleWithItsDuration) {
  std::ifstream file(std::filesystem::path(SONARD_SOURCE_DIR) / "docs/faults.md");
  std::string page{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::replace(page.begin(), page.end(), '\n', ' ');
  const std::size_t begin = page.find("Troubles last"), end = page.find("unless `for`", begin);
  ASSERT_LT(end, page.size());
  std::map<std::string, std::string> durations;  // "10 s (`a`, `b`)"
  static const std::regex group(R"re((\d+ s) \(([^)]*)\))re"), name("`([^`]+)`");
  const auto first = page.cbegin() + static_cast<std::ptrdiff_t>(begin), last = page.cbegin() + static_cast<std::ptrdiff_t>(end);
  for (std::sregex_iterator one(first, last, group); one != std::sregex_iterator(); ++one) {
    const std::string names = (*one)[2];
    for (std::sregex_iterator n(names.begin(), names.end(), name); n != std::sregex_iterator(); ++n)
      durations[(*n)[1]] = (*one)[1];
  }
  std::map<std::string, std::string> expected;
  for (const Trouble& trouble : troubles()) expected[std::string(trouble.name)] = text::format("%g s", trouble.default_s);
  EXPECT_EQ(durations, expected);
}

}  // namespace
}  // namespace sonar
