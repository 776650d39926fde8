// ESRI ASCII grids: some header lines, then rows of heights from north to south.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "core/base/letters.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/height_values.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_bytes = std::size_t{512} << 20;

// The words of a text, with their line numbers.
class Words {
 public:
  explicit Words(std::string text)
      : text_(std::move(text)), at_(text_.starts_with(byte_order_mark) ? byte_order_mark.size() : 0) {}
  std::string_view next() {
    while (at_ < text_.size() && (is_between(text_[at_]) || text_[at_] == '#')) {
      if (text_[at_] == '#') at_ = std::min(text_.find('\n', at_), text_.size() - 1);  // a comment
      line_ += text_[at_++] == '\n';
    }
    const std::size_t from = at_;
    while (at_ < text_.size() && !is_between(text_[at_])) ++at_;
    return std::string_view(text_).substr(from, at_ - from);
  }
  std::size_t line() const { return line_; }
  /// Ends the header. The heights begin with the word that was read last.
  void end_header(std::string_view word) { at_ -= word.size(), in_header_ = false; }

 private:
  /// True if no word contains the character. Some programs write "ncols = 4" or "ncols: 4".
  bool is_between(char c) const {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || (in_header_ && (c == '=' || c == ':'));
  }
  std::string text_;
  std::size_t at_, line_ = 1;
  bool in_header_ = true;
};

struct Header {
  std::size_t columns = 0, rows = 0;
  double x = 0, y = 0, cell_x = 0, cell_y = 0;  // x, y: the middle of the cell in the south-west
  bool has_place = true;
  std::string no_data = "-9999";
};

/// The normalised name of a key: in small letters, without "_", and with American spelling.
std::string key_of(std::string_view word) {
  std::string key = small_letters(word.substr(0, 20));
  std::erase(key, '_');
  if (key.starts_with("nodata")) return "nodata_value";
  if (key.ends_with("centre")) key.replace(key.size() - 2, 2, "er");
  return key;
}

Result<Header> read_header(Words& words) {
  std::map<std::string, double> found;
  Header h;
  const auto bad = [&](std::string what) {
    return failure(ErrorKind::bad_data, "line " + std::to_string(words.line()) + ": " + std::move(what));
  };
  while (true) {
    const std::string_view word = words.next();
    const bool is_whole =
        found.contains("ncols") && found.contains("nrows") && (found.contains("cellsize") || found.contains("dy"));
    const bool is_name = !word.empty() && ((word[0] | 32) >= 'a' && (word[0] | 32) <= 'z');
    if (word.empty() || height_number(word) || (is_whole && !is_name)) {
      words.end_header(word);
      break;
    }
    const std::string key = key_of(word);
    static constexpr std::array<const char*, 10> keys{"ncols",     "nrows",    "xllcorner", "yllcorner", "xllcenter",
                                                      "yllcenter", "cellsize", "dx",        "dy",        "nodata_value"};
    if (std::none_of(keys.begin(), keys.end(), [&](const char* k) { return key == k; })) {
      return bad(word_text(key) +
                 " is not a header word of an ESRI ASCII grid; convert other grids: gdal_translate -of AAIGrid IN OUT.asc");
    }
    const std::string_view value = words.next();
    const auto number = height_number(value);
    if (!number || (std::isnan(*number) && key != "nodata_value")) return bad(key + " needs a number, not " + word_text(value));
    if (key == "nodata_value") h.no_data = value;
    found[key] = *number;
  }
  if (found.contains("cellsize")) found.insert({{"dx", found["cellsize"]}, {"dy", found["cellsize"]}});
  const char* const cell_x = found.contains("dy") ? "dx" : "cellsize";
  for (const char* key : {"ncols", "nrows", cell_x, "dy"}) {
    if (!found.contains(key)) return bad(std::string(key) + " is missing in the header");
  }
  h.cell_x = found["dx"], h.cell_y = found["dy"];
  const bool has_x = found.contains("xllcorner") || found.contains("xllcenter"),
             has_y = found.contains("yllcorner") || found.contains("yllcenter");
  if (has_x != has_y) return bad(std::string(has_x ? "y" : "x") + "llcorner is missing in the header");
  h.has_place = has_x;
  const auto middle_of_first = [&](const char* corner, const char* centre, double cell) {
    return found.contains(centre) ? found[centre] : found[corner] + 0.5 * cell;
  };
  h.x = middle_of_first("xllcorner", "xllcenter", h.cell_x), h.y = middle_of_first("yllcorner", "yllcenter", h.cell_y);
  const double columns = found["ncols"], rows = found["nrows"];
  const bool whole = columns == std::floor(columns) && rows == std::floor(rows);
  if (!whole || columns < 2 || rows < 2 || columns * rows > static_cast<double>(max_mesh_triangles) / 2) {
    return bad("ncols and nrows must be whole numbers from 2, at most 10 million cells together");
  }
  h.columns = static_cast<std::size_t>(columns), h.rows = static_cast<std::size_t>(rows);
  for (const double cell : {h.cell_x, h.cell_y})
    if (!(cell > 1e-6 && cell < 1e5)) return bad("cellsize must be between 1e-6 and 1e5 m");
  if (std::abs(h.x) > 1e8 || std::abs(h.y) > 1e8) return bad("the corner is farther than 1e8 m away");
  return h;
}

}  // namespace

Result<HeightGrid> read_esri_heights(const std::filesystem::path& file, const HeightOptions& options) {
  const auto bad = [&](std::string what) { return failure(ErrorKind::bad_data, file.string() + ": " + std::move(what)); };
  auto text = read_regular(file, most_bytes);
  if (!text) return tl::make_unexpected(text.error());
  if (text->size() > most_bytes) return bad("larger than 512 MiB; cut it or use a coarser grid");
  Words words(*std::move(text));
  const auto header = read_header(words);
  if (!header) return bad(header.error().text);
  const std::size_t columns = header->columns, rows = header->rows;
  RawHeights raw{.system = system_by_prj(file)};  // grows with the contents of the file, not with the sizes in its header
  HeightValues values(header->no_data);
  for (std::size_t i = 0; i < rows * columns; ++i) {
    const std::string_view word = words.next();
    const std::string where = "line " + std::to_string(words.line()) + ": ";
    if (word.empty()) {
      return bad(where + "the grid ends after " + std::to_string(i) + " of " + std::to_string(rows * columns) + " heights");
    }
    const auto number = height_number(word);
    if (!number) return bad(where + word_text(word) + " is not a height");
    const auto z = values.height_of(*number);
    if (!z) return bad(where + "the height " + std::string(word.substr(0, 40)) + " is beyond 1e7 m");
    raw.z.push_back(*z);
  }
  if (!words.next().empty()) return bad("more heights than ncols x nrows");

  raw.turn_rows(columns);  // the file starts in the north, the grid in the south
  for (std::size_t i = 0; i < columns; ++i) raw.x.push_back(header->x + static_cast<double>(i) * header->cell_x);
  for (std::size_t j = 0; j < rows; ++j) raw.y.push_back(header->y + static_cast<double>(j) * header->cell_y);
  raw.fill_values = values.fill_values();
  auto grid = finish_heights(std::move(raw), options);
  if (!grid) return bad(grid.error().text);
  if (!header->has_place && !options.centred)
    grid->notes.push_back("its header has neither xllcorner nor yllcorner; they are read as 0");
  return grid;
}

}  // namespace sonar
