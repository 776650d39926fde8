// The generated table of docs/faults.md is that of the code.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/text/format.hpp"
#include "daemon/config/faults/kinds.hpp"

namespace sonar {
namespace {

/// The table behind `<!-- generated: NAME -->`.
std::string table_of(const std::string& name) {
  std::ifstream page(std::filesystem::path(SONARD_SOURCE_DIR) / "docs/faults.md");
  std::string line, table;
  while (std::getline(page, line) && line != "<!-- generated: " + name + " -->") {
  }
  while (std::getline(page, line) && line.starts_with("|")) table += line + "\n";
  return table;
}

std::string table_of_troubles() {
  std::string text = "| trouble | what happens | kinds | lasts |\n|---|---|---|---|\n";
  for (const Trouble& trouble : troubles()) {
    std::string kinds;
    for (const Trouble::Part& part : trouble.parts)
      if (!part.code.empty()) kinds += (kinds.empty() ? "" : ", ") + std::string(part.code);
    text += "| `" + std::string(trouble.name) + "` | " + std::string(trouble.sentence) + " | " + kinds +
            text::format(" | %g s |\n", trouble.default_s);
  }
  return text;
}

TEST(FaultDocs, TroublesAreThoseOfTheCode) {
  EXPECT_EQ(table_of("troubles"), table_of_troubles()) << "docs/faults.md: the table of troubles must be\n"
                                                       << table_of_troubles();
}

}  // namespace
}  // namespace sonar
