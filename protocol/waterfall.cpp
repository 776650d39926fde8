#include "protocol/waterfall.hpp"

#include <algorithm>
#include <utility>

namespace sonar::protocol {
namespace {

constexpr double shown_db = 60;  // levels down to this far below the strongest echo are shown

/// The scale follows the strongest echo of all lines shown, so that it is the same for all of them.
SonarPicture picture_of(const std::deque<std::shared_ptr<const Line>>& waterfall, double start_m, double row_m) {
  SonarPicture seen{.kind = PictureKind::waterfall, .image = {}};
  seen.image.rows = waterfall.size();
  seen.image.beams = waterfall.front()->size();
  seen.image.row_spacing_m = row_m;
  seen.image.start_m = start_m;
  float most_db = -1000;
  for (const auto& profile : waterfall) most_db = std::max(most_db, *std::max_element(profile->begin(), profile->end()));
  for (const auto& profile : waterfall)
    for (const float db : *profile)
      seen.image.samples.push_back(std::clamp(255 * (1 + (db - most_db) / static_cast<float>(shown_db)), 0.0f, 255.0f));
  return seen;
}

}  // namespace

void Waterfall::add(Line line, double start_m, double row_m, HostPing& ping) {
  if (start_m != start_m_ || row_m != row_m_ || (!lines_.empty() && lines_.front()->size() != line.size())) lines_.clear();
  start_m_ = start_m;
  row_m_ = row_m;
  lines_.push_front(std::make_shared<const Line>(std::move(line)));
  if (lines_.size() > waterfall_rows) lines_.pop_back();
  ping.lines = lines_.size();
  ping.whole_lines = waterfall_fewest_rows;
  ping.drawing = [lines = lines_, start_m, row_m] { return picture_of(lines, start_m, row_m); };
}

}  // namespace sonar::protocol
