#include "protocol/line_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/geometry.hpp"

namespace sonar::protocol {
namespace {

constexpr float not_measured = -1;
constexpr float silent_db = -std::numeric_limits<float>::infinity();

}  // namespace

PolarImage empty_fan(double half_rad, double range_m) {
  constexpr std::size_t rows = 300, beams = 100;  // a picture extends half a beam beyond the outermost beams
  PolarImage image{rows, beams, range_m / rows, {}, std::vector<float>(rows * beams)};
  for (std::size_t i = 0; i < beams; ++i) image.azimuth_rad.push_back(half_rad * (1 - 2 * static_cast<double>(i) / (beams - 1)));
  return image;
}

/// Returns the strongest sample between two ranges, so that a thin echo stays visible when the newest line has larger rows.
float Waterfall::level_between(const Row& row, double from_m, double to_m) {
  if (!(row.row_m > 0)) return silent_db;
  constexpr double rounding = 1e-6;  // in samples
  const double all = static_cast<double>(row.line->size());
  const double first = std::max(0.0, std::floor((from_m - row.start_m) / row.row_m + rounding));
  const double last = std::min(all, std::ceil((to_m - row.start_m) / row.row_m - rounding));
  if (!(first < last)) return silent_db;
  const auto at = [&row](double sample) { return row.line->begin() + static_cast<std::ptrdiff_t>(sample); };
  return *std::max_element(at(first), at(last));
}

/// Makes the drawing. Its scale follows the strongest echo of all lines shown, and is the same for all lines.
SonarPicture Waterfall::picture_of(const std::deque<Row>& rows, float shown_db) {
  const Row& newest = rows.front();
  SonarPicture seen{.kind = PictureKind::waterfall, .image = {}};
  seen.image.rows = rows.size();
  seen.image.beams = newest.line->size();
  seen.image.row_spacing_m = newest.row_m;
  seen.image.start_m = newest.start_m;
  for (const Row& row : rows) {
    seen.row_age_s.push_back(std::max(0.0, seconds(newest.received_at - row.received_at)));
    for (std::size_t i = 0; i < newest.line->size(); ++i) {
      const double from_m = newest.start_m + static_cast<double>(i) * newest.row_m;
      seen.image.samples.push_back(level_between(row, from_m, from_m + newest.row_m));
    }
  }
  const float most_db = std::max(-1000.0f, *std::ranges::max_element(seen.image.samples));
  for (float& sample : seen.image.samples)
    sample = sample == silent_db ? not_measured : std::clamp(255 * (1 + (sample - most_db) / shown_db), 0.0f, 255.0f);
  return seen;
}

void Waterfall::add(Line line, double start_m, double row_m, Time received_at, HostPing& ping) {
  rows_.push_front({std::make_shared<const Line>(std::move(line)), start_m, row_m, received_at});
  if (rows_.size() > waterfall_rows) rows_.pop_back();
  ping.lines = rows_.size();
  ping.whole_lines = waterfall_fewest_rows;
  ping.drawing = [rows = rows_, shown_db = shown_db_] { return picture_of(rows, shown_db); };
}

double Sweep::bearing_rad(std::size_t direction) const {
  const auto all = static_cast<double>(lines_.size());
  return (all / 2 - static_cast<double>(direction)) * 2 * pi / all;
}

// A scan of the half circle ahead would fill only half of a round picture, so the picture shows only that half. Once there is a
// line outside that half, the picture shows a whole turn.
PolarImage Sweep::shown() const {
  bool only_ahead = lines_.size() % 4 == 0;
  for (std::size_t i = 0; i < lines_.size(); ++i)
    only_ahead = only_ahead && (lines_[i] == nullptr || (i >= ahead_begin() && i < ahead_end()));
  const std::size_t begin = only_ahead ? ahead_begin() : 0;
  PolarImage image;
  image.rows = rows_;
  image.beams = only_ahead ? ahead_end() - begin : lines_.size();
  image.row_spacing_m = row_m_;
  image.samples.resize(rows_ * image.beams);
  for (std::size_t beam = 0; beam < image.beams; ++beam) {
    image.azimuth_rad.push_back(bearing_rad(begin + beam));
    if (const auto& line = lines_[begin + beam])
      for (std::size_t row = 0; row < rows_; ++row) image.samples[row * image.beams + beam] = (*line)[row];
  }
  return image;
}

void Sweep::add(std::size_t direction, Line line, double row_m, HostPing& ping) {
  // Lines with another range cannot be in one picture with the earlier lines.
  if (rows_ != line.size() || row_m_ != row_m) lines_.assign(lines_.size(), nullptr);
  rows_ = line.size();
  row_m_ = row_m;
  lines_[direction] = std::make_shared<const Line>(std::move(line));
  // The picture is drawn later, perhaps by another thread, so it gets a copy. Lines are shared, which makes the copy cheap.
  const auto now = std::make_shared<const Sweep>(*this);
  ping.picture = [now]() -> Result<PolarImage> { return now->shown(); };
  ping.drawing = [now, head_rad = bearing_rad(direction)] {
    return SonarPicture{.kind = PictureKind::sweep, .image = now->shown(), .head_rad = head_rad};
  };
  const auto at = [this](std::size_t i) { return lines_.begin() + static_cast<std::ptrdiff_t>(i); };
  ping.lines = static_cast<std::size_t>(
      std::count_if(at(ahead_begin()), at(ahead_end()), [](const auto& scanned) { return scanned != nullptr; }));
  ping.whole_lines = ahead_end() - ahead_begin();
}

}  // namespace sonar::protocol
