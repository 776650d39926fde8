#include "core/image/terminal_fan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>

namespace sonar {
namespace {

constexpr int label_columns = 7;  // " 100 m" and a gap
constexpr int dots = 4;           // pixels of the drawn picture across a cell; a cell is twice as high as it is wide
constexpr int fewest_columns = 24, fewest_lines = 8;

struct Cell {
  Rgb upper, lower;
  bool outside = false;  // true if the whole cell lies outside the fan
  char letter = 0;       // if not 0: a character of a label, shown instead of the picture
};
struct Grid {
  int columns = 0, lines = 0;
  std::vector<Cell> cells;
  Cell& at(int column, int line) {
    return cells[static_cast<std::size_t>(line) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)];
  }
};

/// The mean colour of half a cell, which is a square of the drawn picture.
Rgb mean_colour(const Raster& raster, int left, int top) {
  int r = 0, g = 0, b = 0, count = 0;
  for (int y = top; y < std::min(top + dots, raster.height); ++y) {
    for (int x = left; x < std::min(left + dots, raster.width); ++x) {
      const Rgb& p = raster.at(x, y);
      r += p.r, g += p.g, b += p.b, ++count;
    }
  }
  if (count == 0) return raster.at(0, 0);
  return {static_cast<std::uint8_t>(r / count), static_cast<std::uint8_t>(g / count), static_cast<std::uint8_t>(b / count)};
}

/// Makes the cells of the drawn picture. The corner of the picture lies outside every fan, so cells with the corner's colour
/// are outside.
Grid grid_from(const Raster& raster, int columns) {
  Grid grid;
  grid.columns = columns;
  grid.lines = (raster.height + 2 * dots - 1) / (2 * dots);
  grid.cells.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.lines));
  const Rgb outside = raster.at(0, 0);
  for (int line = 0; line < grid.lines; ++line) {
    for (int column = 0; column < grid.columns; ++column) {
      Cell& cell = grid.at(column, line);
      cell.upper = mean_colour(raster, dots * column, 2 * dots * line);
      cell.lower = mean_colour(raster, dots * column, 2 * dots * line + dots);
      cell.outside = cell.upper == outside && cell.lower == outside;
    }
  }
  return grid;
}

void put_labels(Grid& grid, const PolarImage& image, const FanLayout& layout) {
  const double spacing = ring_spacing_m(image.range_m()), edge = image.azimuth_rad.back();
  int last_line = grid.lines;  // at most one label per line, from near to far
  for (int ring = 1; ring * spacing <= image.range_m() * 1.0001; ++ring) {
    const int line = static_cast<int>(layout.y_of(edge, ring * spacing) / (2 * dots));
    const int column = static_cast<int>(layout.x_of(edge, ring * spacing) / dots) + 2;
    if (line == last_line || line < 0 || line >= grid.lines) continue;
    last_line = line;
    char label[32];
    const int length = std::snprintf(label, sizeof label, "%g m", ring * spacing);
    for (int i = 0; i < length && column + i < grid.columns; ++i) grid.at(column + i, line).letter = label[i];
  }
}

double brightness(Rgb c) { return (0.299 * c.r + 0.587 * c.g + 0.114 * c.b) / 255; }

char letter_for(const Cell& cell) {
  static constexpr char ramp[] = " .:-=+*#%@";
  const double value = (brightness(cell.upper) + brightness(cell.lower)) / 2;
  return ramp[std::min(9, static_cast<int>(value * 10))];
}

std::string colour_code(TerminalColours colours, Rgb c, bool foreground) {
  char code[40];
  if (colours == TerminalColours::palette_256)
    std::snprintf(code, sizeof code, "\x1b[%d;5;%dm", foreground ? 38 : 48, palette_index(c));
  else
    std::snprintf(code, sizeof code, "\x1b[%d;2;%d;%d;%dm", foreground ? 38 : 48, c.r, c.g, c.b);
  return code;
}

/// Writes cells. A colour code is written only where the colour changes.
class LineWriter {
 public:
  explicit LineWriter(TerminalColours colours) : colours_(colours) {}

  void plain(char letter) {
    if (upper_ || lower_) line_ += "\x1b[0m";
    upper_.reset(), lower_.reset();
    line_ += letter;
  }
  void block(const Cell& cell) {
    if (!upper_ || *upper_ != cell.upper) line_ += colour_code(colours_, cell.upper, true);
    if (!lower_ || *lower_ != cell.lower) line_ += colour_code(colours_, cell.lower, false);
    upper_ = cell.upper, lower_ = cell.lower;
    line_ += "\u2580";  // upper half block
  }
  std::string take() {
    if (upper_ || lower_) line_ += "\x1b[0m";
    while (!line_.empty() && line_.back() == ' ') line_.pop_back();
    return std::move(line_);
  }

 private:
  TerminalColours colours_;
  std::optional<Rgb> upper_, lower_;
  std::string line_;
};

std::string text_of(Grid& grid, int line, TerminalColours colours) {
  LineWriter writer(colours);
  for (int column = 0; column < grid.columns; ++column) {
    const Cell& cell = grid.at(column, line);
    if (cell.letter != 0)
      writer.plain(cell.letter);
    else if (cell.outside)
      writer.plain(' ');
    else if (colours == TerminalColours::none)
      writer.plain(letter_for(cell));
    else
      writer.block(cell);
  }
  return writer.take();
}

}  // namespace

Result<std::vector<std::string>> draw_terminal_picture(const SonarPicture& picture, const TerminalStyle& style) {
  const PolarImage& image = picture.image;
  if (style.columns < fewest_columns || style.lines < fewest_lines)
    return failure(ErrorKind::usage, "the terminal is too small for a picture: " + std::to_string(style.columns) +
                                         " columns and " + std::to_string(style.lines) + " lines, at least 24 and 8 are needed");
  FanStyle drawing;
  drawing.rings = false;
  drawing.colours = style.colours == TerminalColours::none ? *find_colour_map("gray") : style.map;
  const int room = style.columns - (style.labels ? label_columns : 0);
  drawing.width_px = std::clamp(dots * room, 64, 8000);
  Result<Raster> raster = PicturePainter(drawing).draw(picture);
  const int available = 2 * dots * style.lines;
  if (raster && raster->height > available) {
    drawing.width_px = std::max(64, drawing.width_px * available / raster->height / dots * dots);
    raster = PicturePainter(drawing).draw(picture);
  }
  if (!raster) return tl::unexpected(raster.error());
  Grid grid = grid_from(*raster, (drawing.width_px + dots - 1) / dots + (style.labels ? label_columns : 0));
  if (style.labels && picture.is_polar()) put_labels(grid, image, fan_layout(image, drawing, opens_of(picture)));
  std::vector<std::string> lines;
  for (int line = 0; line < std::min(grid.lines, style.lines); ++line) lines.push_back(text_of(grid, line, style.colours));
  return lines;
}

int palette_index(Rgb colour) {
  static constexpr int levels[] = {0, 95, 135, 175, 215, 255};
  const auto nearest_level = [](int value) {
    const auto nearer = [value](int a, int b) { return std::abs(a - value) < std::abs(b - value); };
    return static_cast<int>(std::min_element(std::begin(levels), std::end(levels), nearer) - std::begin(levels));
  };
  const int r = nearest_level(colour.r), g = nearest_level(colour.g), b = nearest_level(colour.b);
  const int mean = (colour.r + colour.g + colour.b) / 3;
  const int gray = std::clamp((mean - 8 + 5) / 10, 0, 23), gray_value = 8 + 10 * gray;
  const auto distance = [colour](int x, int y, int z) {
    const int dr = colour.r - x, dg = colour.g - y, db = colour.b - z;
    return dr * dr + dg * dg + db * db;
  };
  const bool in_cube = distance(levels[r], levels[g], levels[b]) <= distance(gray_value, gray_value, gray_value);
  return in_cube ? 16 + 36 * r + 6 * g + b : 232 + gray;
}

}  // namespace sonar
