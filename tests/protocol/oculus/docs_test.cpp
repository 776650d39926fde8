// Tests that docs/protocols/oculus.md describes every option, and that the page of evidence lists every file with an assumption.
#include <filesystem>
#include <fstream>

#include "protocol/oculus/settings.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}
std::string page(const char* name) { return text_of(std::filesystem::path(SONARD_SOURCE_DIR) / "docs" / name); }

/// Returns the rows of the table after `<!-- generated: NAME -->`.
std::string rows_of(const std::string& text, const std::string& name) {
  std::istringstream lines(text);
  std::string line, rows;
  while (std::getline(lines, line) && line != "<!-- generated: " + name + " -->") {
  }
  for (int number = 0; std::getline(lines, line) && line.starts_with("|"); ++number)
    if (number >= 2) rows += line + "\n";  // below the heading
  return rows;
}

TEST(ProtocolPage, HasEveryOption) {
  EXPECT_EQ(rows_of(page("protocols/oculus.md"), "options"), options_table())
      << "docs/protocols/oculus.md, table options: the rows must be\n"
      << options_table();
}

TEST(ProtocolPage, NamesEveryFileWithSomethingUnknown) {
  const std::string evidence = page("decisions/0025-oculus-evidence.md");
  int files = 0;
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(SONARD_SOURCE_DIR) / "protocol/oculus"))
    if (file.path().extension() != ".md" && text_of(file.path()).find("unknown:") != std::string::npos) {
      ++files;
      EXPECT_NE(evidence.find("`" + file.path().filename().string() + "`"), std::string::npos) << file.path();
    }
  EXPECT_GE(files, 5);
}

}  // namespace
}  // namespace sonar::oculus::tests
