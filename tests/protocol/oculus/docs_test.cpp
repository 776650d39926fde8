// The tables of docs/protocols/oculus.md are those of the code. Generated are all columns but the last, which says in words what
// a value means or why it was chosen.
#include <filesystem>
#include <fstream>

#include "protocol/oculus/options.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

using Rows = std::vector<wire::Namer::Row>;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}
std::string page() { return text_of(std::filesystem::path(SONARD_SOURCE_DIR) / "docs/protocols/oculus.md"); }

/// Rows of the table behind `<!-- generated: NAME -->`, and of each the last cell.
struct Table {
  std::string rows;  // without the last cell
  std::vector<std::string> words;
};
Table table_of(const std::string& name) {
  std::istringstream text(page());
  Table table;
  std::string line;
  while (std::getline(text, line) && line != "<!-- generated: " + name + " -->") {
  }
  for (int number = 0; std::getline(text, line) && line.starts_with("|"); ++number) {
    if (number < 2) continue;  // heading
    const std::size_t cut = line.rfind('|', line.size() - 2) + 1;
    table.rows += line.substr(0, cut) + "\n";
    table.words.push_back(line.substr(cut, line.size() - 1 - cut));
  }
  return table;
}

void expect_table(const std::string& name, const std::string& generated) {
  EXPECT_EQ(table_of(name).rows, generated) << "docs/protocols/oculus.md, table " << name << ": the left columns must be\n"
                                            << generated;
}

/// Fields by the vendor's own names, those of nested messages in front left out.
template <class M>
Rows rows_of(std::initializer_list<std::string_view> left_out) {
  wire::Namer namer;
  const M message{};
  fields(namer, message);
  Rows rows;
  for (wire::Namer::Row& row : namer.rows) {
    const bool wanted = std::none_of(left_out.begin(), left_out.end(), [&](auto prefix) { return row.name.starts_with(prefix); });
    if (const std::size_t dot = row.name.rfind('.'); dot != std::string::npos) row.name.erase(0, dot + 1);
    if (wanted) rows.push_back(row);
  }
  return rows;
}

/// A line of a table but for its last cell.
std::string line(std::initializer_list<std::string> cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text.append(cell.empty() ? "" : " ").append(cell).append(" |");
  return text.append("\n");
}
std::string end_at(std::size_t offset) { return line({std::to_string(offset), "", ""}); }
std::string lines_of(const Rows& rows) {
  std::string text;
  for (const auto& row : rows) text += line({std::to_string(row.offset), row.type, row.name});
  return text;
}

/// Two versions side by side: rows of the same name and type share a line.
std::string merged(const Rows& first, const Rows& second) {
  std::string text;
  auto other = second.begin();
  for (const auto& row : first) {
    const auto match = std::find_if(other, second.end(), [&](const auto& r) { return r.name == row.name && r.type == row.type; });
    if (match == second.end()) {
      text += line({std::to_string(row.offset), "", row.type, row.name});
      continue;
    }
    for (; other != match; ++other) text += line({"", std::to_string(other->offset), other->type, other->name});
    text += line({std::to_string(row.offset), std::to_string(match->offset), row.type, row.name});
    other = match + 1;
  }
  return text;
}

TEST(ProtocolPage, HasEveryFixedMessage) {
  expect_table("header", lines_of(rows_of<MessageHeader>({})));
  expect_table("status", lines_of(rows_of<StatusMessage>({"header."})) + end_at(status_size));
  expect_table("user configuration", lines_of(rows_of<UserConfigMessage>({"header."})) + end_at(user_config_size));
}

TEST(ProtocolPage, HasBothFireMessages) {
  const Rows both = rows_of<FireMessageV2>({"header."}), first = rows_of<FireMessageV1>({"header."});
  const std::string begin = lines_of(first);
  ASSERT_EQ(lines_of(both).substr(0, begin.size()), begin) << "version 2 begins as version 1";
  expect_table("fire", begin + end_at(fire_v1_size) + lines_of(both).substr(begin.size()) + end_at(fire_v2_size));
}

TEST(ProtocolPage, HasBothPingResults) {
  const std::string fixed =
      merged(rows_of<PingResultV1>({"header.", "fire."}), rows_of<PingResultV2>({"header.", "fire.", "extension."}));
  const std::string bearings = line({std::to_string(ping_v1_size), std::to_string(ping_v2_size), "i16 x nBeams", "bearings"});
  const std::string image = line({std::to_string(image_offset), std::to_string(image_offset), "rows", "image"});
  expect_table("ping", fixed + bearings + image);
}

TEST(ProtocolPage, HasEveryOption) {
  const Table table = table_of("options");
  EXPECT_EQ(table.rows.substr(0, options_table().size()), options_table())
      << "docs/protocols/oculus.md, table options: the left columns must begin with\n"
      << options_table();
  for (const std::string& why : table.words) EXPECT_GT(why.size(), 5u) << "a choice without a reason in " << table.rows;
}

TEST(ProtocolPage, NamesEveryFileWithSomethingUnknown) {
  const std::string rows = table_of("options").rows;
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(SONARD_SOURCE_DIR) / "protocol/oculus"))
    if (file.path().extension() != ".md" && text_of(file.path()).find("unknown:") != std::string::npos) {
      EXPECT_NE(rows.find("`" + file.path().filename().string() + "`"), std::string::npos) << file.path();
    }
}

}  // namespace
}  // namespace sonar::oculus::tests
