// Reads text grids with one point per line, "x y z" (GDAL's XYZ): points of a uniform grid in any order; some may be missing.
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>
#include <utility>

#include "core/base/letters.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/height_values.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_xyz_bytes = std::size_t{1} << 30;

struct Point {
  double x, y;
  float z;
};

constexpr std::size_t most_columns = 16;
using Line = std::array<std::string_view, most_columns>;

/// Splits a line into words between blanks, commas, semicolons or bars, without quotes. Returns their number, up to the size of
/// `words`.
std::size_t split(std::string_view line, Line& words, std::string_view between = " \t,;|\r\"") {
  std::size_t count = 0;
  for (std::size_t at = line.find_first_not_of(between); at != std::string_view::npos && count < words.size();) {
    const std::size_t end = std::min(line.find_first_of(between, at), line.size());
    words[count++] = line.substr(at, end - at);
    at = line.find_first_not_of(between, end);
  }
  return count;
}

/// Splits a line into the fields between `mark` characters, without blanks and quotes around them. A field may be empty.
std::size_t split_at(char mark, std::string_view line, Line& fields) {
  std::size_t count = 0;
  for (std::size_t at = 0; at <= line.size() && count < fields.size();) {
    const std::size_t end = std::min(line.find(mark, at), line.size());
    fields[count++] = trimmed(line.substr(at, end - at), " \t\r\"");
    at = end + 1;
  }
  return count;
}

/// True if tabs separate the fields of a table that begins with this line; otherwise tabs count as blanks.
bool has_tab_marks(std::string_view line) {
  Line fields;
  const std::size_t count = line.find('\t') == line.npos ? 0 : split_at('\t', line, fields);
  return count >= 3 && std::all_of(fields.begin(), fields.begin() + static_cast<std::ptrdiff_t>(count),
                                   [](auto field) { return !field.empty(); });
}

/// Splits a line of values. In a table with commas, semicolons, bars or (if `by_tabs`) tabs, empty fields count too, because a
/// missing value must not shift the values after it. A line with only empty fields, which spreadsheets write for an empty row,
/// has no values.
std::size_t split_values(std::string_view line, bool by_tabs, Line& words) {
  for (const char mark : {';', '|', ',', '\t'}) {
    if (line.find(mark) == line.npos || (mark == '\t' && !by_tabs)) continue;
    const std::size_t count = split_at(mark, line, words);
    const auto fields = std::span(words).first(count);
    if (std::ranges::all_of(fields, [](std::string_view field) { return field.empty(); })) return 0;
    if (std::ranges::none_of(fields, [](std::string_view field) { return field.find_first_of(" \t") != field.npos; }))
      return count;
    break;
  }
  return split(line, words);
}

/// Uniform coordinates. An axis between two far points can have millions of them, so they are listed only after their number is
/// checked.
struct EvenAxis {
  double first = 0, step = 0;
  std::size_t size = 0;
};

/// Finds the uniform coordinates that contain all given ones, among which some may be missing. Size 0: there are none.
EvenAxis even_axis(std::vector<double> given) {
  std::sort(given.begin(), given.end());
  given.erase(std::unique(given.begin(), given.end()), given.end());
  if (given.size() < 2) return {};
  std::vector<double> steps;
  for (std::size_t i = 1; i < given.size(); ++i) steps.push_back(given[i] - given[i - 1]);
  std::vector<double> sorted = steps;
  const std::size_t middle = (sorted.size() - 1) / 2;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(middle), sorted.end());
  const double usual = sorted[middle];
  double sum = 0, count = 0;  // the mean step is more accurate than one rounded step
  for (const double step : steps)
    if (step < 1.5 * usual) sum += step, ++count;
  const double cells = std::round((given.back() - given.front()) / (sum / count));
  if (!(cells >= 1 && cells < static_cast<double>(max_mesh_triangles))) return {};
  const double step = (given.back() - given.front()) / cells;
  if (!(step > 1e-7 && step < 1e5)) return {};
  const bool even = std::all_of(given.begin(), given.end(), [&](double v) {
    const double at = (v - given.front()) / step;
    return std::abs(at - std::round(at)) < 0.2;
  });
  return even ? EvenAxis{given.front(), step, static_cast<std::size_t>(cells) + 1} : EvenAxis{};
}

std::vector<double> coordinates(const EvenAxis& axis) {
  std::vector<double> all(axis.size);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = axis.first + static_cast<double>(i) * axis.step;
  return all;
}

/// Returns the index of the nearest coordinate. The spacing is computed from the whole length, because single steps are rounded
/// if coordinates are large.
std::size_t index_on(const std::vector<double>& axis, double v) {
  const double last = static_cast<double>(axis.size() - 1);
  return static_cast<std::size_t>(std::clamp(std::round((v - axis.front()) / (axis.back() - axis.front()) * last), 0.0, last));
}

/// Splits a line of column names. The names may contain blanks if commas, semicolons, bars or tabs separate them.
std::size_t split_names(std::string_view line, Line& words) {
  for (const char mark : {';', '|', ',', '\t'})
    if (line.find(mark) != line.npos) return split_at(mark, line, words);
  return split(line, words);
}

/// Positions of the words for east, north and height in a line.
struct Order {
  std::size_t x = 0, y = 1, z = 2;
  bool depth = false;        // true if the name of the column is depth
  bool has_easting = false;  // true if the name of the x column is easting
  std::size_t last() const { return std::max({x, y, z}); }
  bool operator==(const Order&) const = default;
};

/// Finds the order from column names, such as "lat lon depth", "id,x,y,z" or "OBJECTID,POINT_X,POINT_Y,grid_code". With other
/// names, the first three columns are x, y and z.
Order order_by(const Line& names, std::size_t count) {
  using Begins = std::initializer_list<std::string_view>;
  const auto column = [&](Begins begins, std::size_t otherwise, std::string_view whole, std::string_view last) {
    const auto is_it = [&](std::string_view name) {
      const std::string_view end = name.substr(name.size() - std::min(name.size(), last.size()));
      return same_letters(name, whole) || same_letters(end, last) ||
             std::any_of(begins.begin(), begins.end(),
                         [&](std::string_view begin) { return same_letters(name.substr(0, begin.size()), begin); });
    };
    const auto found = std::find_if(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(count), is_it);
    return found == names.begin() + static_cast<std::ptrdiff_t>(count) ? otherwise
                                                                       : static_cast<std::size_t>(found - names.begin());
  };
  Order order{column({"lon", "lng", "x", "east"}, count, "e", "_x"), column({"lat", "y", "north"}, count, "n", "_y"),
              column({"z", "dep", "elev", "height", "alt", "bathy", "topo"}, count, "z", "_z")};
  if (order.x == count || order.y == count) return {};
  if (order.z == count) order.z = count == 3 ? 3 - order.x - order.y : std::max(order.x, order.y) + 1;
  const bool distinct = order.x != order.y && order.x != order.z && order.y != order.z && order.last() < count;
  if (!distinct) return {};
  order.depth = same_letters(names[order.z].substr(0, 1), "d");
  order.has_easting = same_letters(names[order.x].substr(0, 1), "e");
  return order;
}

/// True if a line has three numbers with decimal commas, "500000,5 6650000,5 -10,2" or "500000,5;6650000,5;-10,2".
bool has_decimal_commas(std::string_view line) {
  Line words;
  const std::size_t count = split(line, words, " \t;\r\"");
  const auto is_decimal = [](std::string_view word) {
    const std::size_t comma = word.find(',');
    const auto digit_at = [&](std::size_t at) { return at < word.size() && word[at] >= '0' && word[at] <= '9'; };
    return comma != word.npos && comma > 0 && digit_at(comma - 1) && digit_at(comma + 1);
  };
  return count >= 3 && std::any_of(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(count), is_decimal);
}

/// True if the northing may be first, as often in lists of surveyed points. Eastings of UTM have six digits, most northings have
/// seven.
bool may_be_northing_first(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr double least_easting = 1.6e5, most_easting = 8.4e5, least_northing = 1e6, most_northing = 1e7;
  return x.front() > least_northing && x.back() < most_northing && y.front() > least_easting && y.back() < most_easting;
}

/// Advice for a file that does not begin with points.
std::string way_out(const std::vector<Point>& points) {
  return points.empty() ? "; other grids: gdal_translate -of GTiff IN OUT.tif" : "";
}

Result<std::vector<Point>> points_of(std::string_view text, HeightValues& values, Order& order) {
  std::vector<Point> points;
  Line words;
  std::size_t line = 0, first_count = 0;
  bool has_names = false, by_tabs = false;
  std::pair<std::size_t, Order> comment;  // number of names in a comment, and the order that they give
  const char line_end = text.find('\n') == text.npos ? '\r' : '\n';
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(line_end, at), text.size());
    const std::string_view this_line = text.substr(at, end - at);
    if (points.empty()) by_tabs = by_tabs || has_tab_marks(this_line);
    const std::size_t count = split_values(this_line, by_tabs, words);
    at = end + 1, ++line;
    if (count == 0) continue;
    if (!words[0].empty() && (words[0].find_first_of("#%!>") == 0 || words[0].starts_with("//"))) {
      if (!points.empty()) continue;
      const std::size_t begin = this_line.find_first_not_of("#%!>/ \t\"");
      Line names;
      const std::size_t number = begin == this_line.npos ? 0 : split_names(this_line.substr(begin), names);
      if (const Order found = order_by(names, number); found != Order())
        comment = {number, found};  // names of columns, if the next line has as many values
      continue;
    }
    const auto bad = [&](const std::string& what) {
      return failure(ErrorKind::bad_data, "line " + std::to_string(line) + ": " + what);
    };
    const auto bad_line = [&] {
      return bad(has_decimal_commas(this_line) ? "numbers have a decimal comma; write points"
                                               : "three numbers are needed, x y z" + way_out(points));
    };
    if (points.empty() && has_decimal_commas(this_line)) return bad_line();
    if (points.empty() && count >= 3 && !height_number(words[0]) && !height_number(words[1])) {
      const std::size_t names = split_names(this_line, words);
      order = order_by(words, names);
      has_names = true;
      continue;
    }
    if (points.empty() && count == 1 && height_number(words[0])) continue;  // the number of points
    if (points.empty() && !has_names && comment.first == count - (words[count - 1].empty() ? 1 : 0)) order = comment.second;
    if (points.empty()) first_count = count;  // decimal commas can change the number of words
    if (count <= order.last() || (count != first_count && has_decimal_commas(this_line))) return bad_line();
    const auto x = height_number(words[order.x]), y = height_number(words[order.y]);
    const auto z = words[order.z].empty() ? std::numeric_limits<double>::quiet_NaN() : height_number(words[order.z]);
    if (!x || !y || !z) return bad_line();
    if (!(std::abs(*x) <= 1e8 && std::abs(*y) <= 1e8)) return bad("the point is farther than 1e8 m away");
    const auto height = values.height_of(*z);
    if (!height) return bad("the height " + std::string(words[order.z].substr(0, 40)) + " is beyond 1e7 m");
    if (points.size() >= max_mesh_triangles / 2) return bad("more than 10 million points; use a coarser grid");
    points.push_back({*x, *y, *height});
  }
  return points;
}

}  // namespace

Result<HeightGrid> read_xyz_heights(const std::filesystem::path& file, const HeightOptions& options) {
  const auto bad = [&](std::string what) { return failure(ErrorKind::bad_data, file.string() + ": " + std::move(what)); };
  const auto text = read_regular(file, most_xyz_bytes);
  if (!text) return tl::make_unexpected(text.error());
  if (text->size() > most_xyz_bytes) return bad("larger than 1 GiB; cut it or use a coarser grid");
  HeightValues values("-9999");
  Order order;
  const auto points = points_of(*text, values, order);
  if (!points) return bad(points.error().text);
  RawHeights raw{.system = system_by_prj(file)};
  const auto axis_of = [&](double Point::*coordinate) {
    std::vector<double> all;
    all.reserve(points->size());
    for (const Point& p : *points) all.push_back(p.*coordinate);
    return even_axis(std::move(all));
  };
  const EvenAxis x = axis_of(&Point::x), y = axis_of(&Point::y);
  const char* const way = "; make a grid of them: gdal_grid, or gmt surface, then gdal_translate -of AAIGrid";
  if (points->empty()) return bad("has no line of three numbers, x y z; coordinates must be metres or decimal degrees");
  if (x.size == 0 || y.size == 0)
    return bad(std::string("its ") + std::to_string(points->size()) + " points are not a uniform grid" + way);
  if (x.size * y.size > max_mesh_triangles / 2)
    return bad(text::format("its points span %zu x %zu cells, more than 10 million: not a grid, or too fine", x.size, y.size) +
               way);
  raw.x = coordinates(x), raw.y = coordinates(y);
  raw.z.assign(raw.x.size() * raw.y.size(), std::numeric_limits<float>::quiet_NaN());
  std::size_t again = 0;
  std::vector<bool> taken(raw.z.size());
  for (const Point& p : *points) {
    const std::size_t at = index_on(raw.y, p.y) * raw.x.size() + index_on(raw.x, p.x);
    again += taken[at];
    taken[at] = true;
    raw.z[at] = p.z;
  }
  raw.fill_values = values.fill_values();
  const bool exchanged = !order.has_easting && (raw.system.name.empty() || raw.system.utm) && may_be_northing_first(raw.x, raw.y);
  const bool positive = std::none_of(raw.z.begin(), raw.z.end(), [](float z) { return z < 0; });
  auto grid = finish_heights(std::move(raw), options);
  if (!grid) return bad(grid.error().text);
  if (order.depth && positive && options.z_scale > 0)
    grid->notes.push_back("its column of depths has no negative value: set z_scale: -1 if they count down from the surface");
  if (exchanged)
    grid->notes.push_back(
        "x and y may be exchanged: its first column looks like northings of UTM; name the columns in a first line: north east z");
  if (again > 0) grid->notes.push_back(text::format("%zu points have the position of an earlier point, and replaced it", again));
  return grid;
}

}  // namespace sonar
