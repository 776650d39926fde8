#include "protocol/ping/ping_host.hpp"

#include <utility>

namespace sonar::ping {

using protocol::HostActions;
using protocol::HostPing;

namespace {

constexpr double shown_db = 60;  // range of levels in a waterfall, below its strongest echo

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

double period_ms_of(const protocol::SettingsOverride& wanted) {
  const double rate_hz = wanted.rate_hz.value_or(0);
  return rate_hz > 0 ? std::clamp(1000 / rate_hz, 1.0, 30000.0) : 0;
}

void Waterfall::add(Line line, double start_m, double row_m, HostPing& ping) {
  if (start_m != start_m_ || row_m != row_m_ || (!lines_.empty() && lines_.front()->size() != line.size())) lines_.clear();
  start_m_ = start_m;
  row_m_ = row_m;
  lines_.push_front(std::make_shared<const Line>(std::move(line)));
  if (lines_.size() > waterfall_rows) lines_.pop_back();
  ping.is_whole = lines_.size() >= waterfall_fewest_rows;
  ping.drawing = [lines = lines_, start_m, row_m] { return picture_of(lines, start_m, row_m); };
}

HostActions PingHost::on_open(std::span<const std::uint16_t>, Time) {
  HostActions actions;
  ask(actions);
  return actions;
}

HostActions PingHost::on_bytes(std::size_t, BytesView received, Time) {
  HostActions actions;
  framer_.append(received);
  while (const auto frame = framer_.next()) {
    if (!frame->sum_is_right) continue;
    on_frame(*frame, actions);
    if (frame->header.id == Id::nack) {
      std::string why;
      for (std::size_t i = 2; i < frame->payload.size(); ++i) why += static_cast<char>(frame->payload[i]);
      actions.emplace_back(Error{ErrorKind::bad_data, "refused a request: " + why});
    }
    if (auto ping = ping_from(*frame)) {
      ping->facts.message_size = header_size + frame->payload.size() + sum_size;
      actions.emplace_back(*std::move(ping));
    }
  }
  return actions;
}

}  // namespace sonar::ping
