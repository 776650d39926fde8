#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "protocol/line_pictures.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping_host.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping {
namespace {

using protocol::HostActions;
using protocol::HostPing;
using text::format;

constexpr double sample_unit_s = 25e-9, sound_mps = 1500;
constexpr int grads = 400, sector = 201, first_grad = 300;  // a scan covers the half circle ahead, from port to starboard
constexpr int astern = 200;                                 // angle at which the beams of a Sweep begin
constexpr std::size_t point_rows = 300;                     // rows of a picture of points

/// Makes the request for points as y, z pairs (yz_point_data, 3011), which suffice for the picture.
Bytes surveyor_request(const protocol::SettingsOverride& wanted) {
  PingParameters p{.end_mm = static_cast<std::int32_t>(std::lround(1000 * wanted.range_m.value_or(usual_range_m))),
                   .enable = static_cast<std::uint8_t>(wanted.rate_hz == 0.0 ? 0 : 1),
                   .yz = 1,
                   .atof = 0};
  if (wanted.gain_percent) p.gain = static_cast<std::int16_t>(std::lround(*wanted.gain_percent));
  if (const double ms = period_ms_of(wanted); ms > 0) p.period_ms = static_cast<std::int16_t>(std::lround(ms));
  return framed_message(Id::set_ping_parameters, 0, p);
}

/// Makes the request for a scan of the half circle ahead. At short ranges the sample period is the shortest, and there are fewer
/// samples; at long ranges there are 1000 samples.
Bytes ping360_request(const protocol::SettingsOverride& wanted) {
  const double range_m = wanted.range_m.value_or(usual_range_m);
  AutoTransmit t;
  const double window = 2 * range_m / sound_mps / sample_unit_s;  // duration of all samples in units of 25 ns
  t.samples = static_cast<std::uint16_t>(std::clamp(window / 80, 200.0, 1000.0));
  t.period = static_cast<std::uint16_t>(std::clamp(window / t.samples, 80.0, 40000.0));
  t.transmit_us = static_cast<std::uint16_t>(std::clamp(8000 * range_m / sound_mps, 5.0, 500.0));  // the maker's rule
  t.khz = 750;
  t.gain = static_cast<std::uint8_t>(std::lround(wanted.gain_percent.value_or(0) / 50));
  t.start = first_grad;
  t.stop = (first_grad + sector - 1) % grads;
  return framed_message(Id::auto_transmit, 0, t);
}

using Points = std::vector<std::pair<double, double>>;  // azimuth and range of each point

/// Returns the points before the first invalid one, or all points.
Points points_in(const YzPointData& data, BytesView rest) {
  Points polar;
  wire::Reader reader(rest);
  for (int i = 0; i < data.points; ++i) {
    float y = 0, z = 0;
    reader("y", y);
    reader("z", z);
    if (!reader.ok() || !std::isfinite(y) || !std::isfinite(z)) break;
    polar.emplace_back(std::atan2(static_cast<double>(y), -static_cast<double>(z)),
                       std::hypot(static_cast<double>(y), static_cast<double>(z)));
  }
  return polar;
}
Points points_in(const AtofPointData& data, BytesView rest) {
  Points polar;
  wire::Reader reader(rest);
  for (int i = 0; i < data.points; ++i) {
    AtofPoint point;
    fields(reader, point);
    const double azimuth = static_cast<double>(point.angle_rad);
    const double range_m = static_cast<double>(point.two_way_s) * static_cast<double>(data.speed_mps) / 2;
    if (!reader.ok() || !(std::abs(azimuth) <= pi) || !(range_m >= 0 && std::isfinite(range_m))) break;
    polar.emplace_back(azimuth, range_m);
  }
  return polar;
}

double end_m(const YzPointData& data, const Points&) { return static_cast<double>(data.end_m); }
/// Returns a lower bound of the far end of the range, because the message states only the listening time, which begins at the
/// near end.
double end_m(const AtofPointData& data, const Points& polar) {
  double far_m = static_cast<double>(data.listening_s) * static_cast<double>(data.speed_mps) / 2;
  for (const auto& point : polar) far_m = std::max(far_m, point.second);
  return far_m;
}

/// Makes a ping of points. The picture has one beam for each point, with the point in the row of its range; the drawing has the
/// points themselves.
HostPing ping_of(std::uint32_t number, double end_m, Points polar) {
  HostPing found;
  SonarPicture seen{.kind = PictureKind::points, .image = {}, .elevation_rad = -pi / 2};
  const double half_rad = static_cast<double>(surveyor::vendor().models().front()->modes.front().horizontal_aperture_rad) / 2;
  seen.image = protocol::empty_fan(half_rad, end_m);
  std::sort(polar.begin(), polar.end(), std::greater<>());
  polar.erase(std::unique(polar.begin(), polar.end(), [](auto a, auto b) { return a.first == b.first; }), polar.end());
  PolarImage image;
  image.rows = point_rows;
  image.beams = polar.size();
  image.row_spacing_m = end_m / point_rows;
  image.samples.resize(image.rows * image.beams);
  double nearest_m = 0, farthest_m = 0;
  for (std::size_t i = 0; i < polar.size(); ++i) {
    const auto [azimuth, range_m] = polar[i];
    image.azimuth_rad.push_back(azimuth);
    nearest_m = i == 0 ? range_m : std::min(nearest_m, range_m);
    farthest_m = std::max(farthest_m, range_m);
    const double row = range_m / image.row_spacing_m;
    if (row >= 0 && row < static_cast<double>(point_rows)) image.samples[static_cast<std::size_t>(row) * image.beams + i] = 255;
  }
  found.facts = {number, static_cast<unsigned>(polar.size()), 1, 32, end_m, end_m, 240e3, 0};
  found.facts.note = polar.empty() ? "no points" : format("points from %.2f to %.2f m", nearest_m, farthest_m);
  found.picture = [image = std::move(image)]() -> Result<PolarImage> {
    if (image.beams >= 2) return image;
    return failure(ErrorKind::usage, "a picture needs two points at least: sonarctl listen prints those of a Surveyor");
  };
  seen.detections = polar.size();
  seen.points = std::move(polar);
  found.drawing = [seen = std::move(seen)] { return seen; };
  return found;
}

class SurveyorHost final : public PingHost {
 public:
  using PingHost::PingHost;

 private:
  std::optional<HostPing> ping_from(const Frame& frame, Time) override {
    if (frame.header.id == Id::atof_point_data) return read(frame, AtofPointData{});
    return frame.header.id == Id::yz_point_data ? read(frame, YzPointData{}) : std::nullopt;
  }
  /// A ping may have its points in both messages. Only the first message that arrives is used.
  template <class Data>
  std::optional<HostPing> read(const Frame& frame, Data data) {
    const auto rest = read_front(frame, data);
    if (!rest || (newest_.first == data.ping && newest_.second != frame.header.id)) return std::nullopt;
    newest_ = {data.ping, frame.header.id};
    Points polar = points_in(data, *rest);
    const double far_m = end_m(data, polar);
    return ping_of(data.ping, far_m, std::move(polar));
  }

  std::pair<std::optional<std::uint32_t>, Id> newest_{};  // number of the newest ping, and the message from which it is read
};

/// The host first requests the protocol version, which changes nothing. UDP has no connection, so only an answer shows that there
/// is a sonar. Then the host requests a scan. A datagram may be lost, so the first request is repeated until a frame arrives.
class Ping360Host final : public PingHost {
 public:
  using PingHost::PingHost;
  HostActions on_open(std::span<const std::uint16_t>, Time now) override {
    ask_again_at_ = now + answer_within;
    return {protocol::HostSend{0, request_for(Id::protocol_version)}};
  }
  HostActions on_tick(Time now) override { return !is_open_ && now >= ask_again_at_ ? on_open({}, now) : HostActions{}; }
  std::optional<Time> next_tick() const override { return is_open_ ? std::nullopt : std::optional(ask_again_at_); }
  /// Stops the scan that this host has requested, but not the scan of another driver.
  HostActions on_leave() override {
    if (!is_open_ || !asks()) return {};
    return {protocol::HostSend{0, framed(Id::motor_off, 0, {})}};
  }
  bool is_open() const override { return is_open_; }

 private:
  /// Handles a frame; any frame shows that there is a sonar.
  void on_frame(const Frame&, HostActions& actions) override {
    if (!std::exchange(is_open_, true)) ask(actions);
  }
  std::optional<HostPing> ping_from(const Frame& frame, Time) override {
    const auto line_of = [&](auto data) -> std::optional<HostPing> {
      const auto rest = read_front(frame, data);
      if (!rest || data.count == 0) return std::nullopt;
      HostPing ping = line(data.angle, data.period, data.khz, rest->first(std::min<std::size_t>(rest->size(), data.count)));
      compare_gain(data.gain, 2, ping);
      return ping;
    };
    if (frame.header.id == Id::auto_device_data) return line_of(AutoDeviceData{});
    return frame.header.id == Id::device_data ? line_of(DeviceData{}) : std::nullopt;
  }

  /// Makes a ping of a scan line. The device does not state a sound speed; 1500 m/s is assumed.
  HostPing line(std::uint16_t angle, unsigned period, unsigned khz, BytesView samples) {
    const double row_m = period * sample_unit_s * sound_mps / 2;
    Line line;
    for (const std::byte sample : samples) line.push_back(static_cast<float>(std::to_integer<int>(sample)));
    HostPing ping;
    ping.facts = {++pings_,  1, static_cast<unsigned>(samples.size()), 8, row_m, row_m * static_cast<double>(samples.size()),
                  1e3 * khz, 0};
    ping.facts.note = "angle " + std::to_string(angle) + " grad";
    sweep_.add(static_cast<std::size_t>((angle + astern) % grads), std::move(line), row_m, ping);
    return ping;
  }

  static constexpr std::chrono::milliseconds answer_within{1000};  // our choice

  bool is_open_ = false;
  Time ask_again_at_{};
  protocol::Sweep sweep_{grads};
  std::uint32_t pings_ = 0;  // a Ping360 does not number its pings
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> ping360::make_host(const protocol::Wanted& wanted) {
  return host_of<Ping360Host>("a Ping360", ping360::vendor(), ping360_request, {"range", "gain", "mode"}, wanted);
}
Result<std::unique_ptr<protocol::Host>> surveyor::make_host(const protocol::Wanted& wanted) {
  return host_of<SurveyorHost>("a Surveyor", surveyor::vendor(), surveyor_request, {"range", "rate", "gain", "mode"}, wanted);
}

}  // namespace sonar::ping
