#include "daemon/emulator/view/ping_payloads.hpp"

#include <algorithm>
#include <cmath>

#include "core/sonar/range_image.hpp"
#include "daemon/emulator/sonar/delivery.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {
namespace {

constexpr float dimmed = 0.4f;  // brightness of parts that the messages do not contain

/// Returns the messages of a ping, as bytes for TCP or as datagrams.
std::vector<protocol::Bytes> messages_of(const Ping& ping, const protocol::Vendor& vendor, const protocol::DeviceState& state) {
  if (const auto framed = FramedPing(vendor, state, ping).bytes()) return {*framed};
  for (const auto kind : {protocol::Port::Kind::udp_stream, protocol::Port::Kind::udp_dialogue})
    if (const protocol::Port* const port = vendor.port(kind)) return vendor.datagrams(*port, ping, state);
  return {};
}

std::unique_ptr<protocol::Host> host_of(const protocol::Make& make) {
  protocol::Wanted wanted;
  wanted.as_it_is = true;
  auto host = make.host(wanted);
  return host ? *std::move(host) : nullptr;
}

/// Returns null if the host shows nothing for this ping.
DriverPicture::Drawing read_by(protocol::Host& host, const protocol::Make& make, const Ping& ping,
                               const protocol::DeviceState& state) {
  DriverPicture::Drawing drawing;
  for (const protocol::Bytes& message : messages_of(ping, *make.device, state))
    for (const protocol::HostAction& action : host.on_bytes(make.ports.size() - 1, message, ping.request.fired_at))
      if (const auto* const read = std::get_if<protocol::HostPing>(&action)) drawing = read->drawing;
  return drawing;
}

SonarPicture picture_of_one(const protocol::Make& make, const Ping& ping, const protocol::DeviceState& state) {
  const auto host = host_of(make);
  const auto drawing = host ? read_by(*host, make, ping, state) : nullptr;
  SonarPicture picture = drawing ? drawing() : SonarPicture{.kind = make.picture, .image = {}};
  if (make.picture != PictureKind::points || picture.column == SonarPicture::Column::sent) return picture;
  picture.column = SonarPicture::Column::model;
  picture.image = polar_image_of(ping, make.shades);
  picture.image.full_scale /= dimmed;
  return picture;
}

}  // namespace

DriverPicture::DriverPicture(const protocol::Make& make) : make_(make) {
  if (make.picture == PictureKind::sweep || make.picture == PictureKind::waterfall) host_ = host_of(make);
}

/// If a picture combines many pings, the host decodes each ping now; otherwise the drawing decodes the ping when it is called.
DriverPicture::Drawing DriverPicture::after(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state) {
  if (make_.picture == PictureKind::fan)
    return [ping, shades = make_.shades] { return SonarPicture{.image = polar_image_of(*ping, shades)}; };
  if (host_) return read_by(*host_, make_, *ping, state);
  return [&make = make_, ping, state = std::make_shared<const protocol::DeviceState>(state)] {
    return picture_of_one(make, *ping, *state);
  };
}

std::string Preview::why_over(const Sonar& sonar, Time now) const {
  if (sonar.connections().has_audience()) return "a driver is connected";
  if (until_ && now >= *until_) return "after " + std::to_string(longest.count()) + " s";
  return {};
}

std::chrono::nanoseconds Preview::period(const Sonar& sonar) {
  const PingSettings& s = sonar.settings();
  return std::max<std::chrono::nanoseconds>(s.beam_count > 1 ? shortest_period : shortest_of_one_beam, ping_period(s));
}

/// Returns a preview that is due; for a sonar in standby, the ping that it would fire if it were on.
std::optional<PingRequest> Preview::due(const Sonar& sonar, Time now) {
  if (!on() || busy_) return std::nullopt;
  if (fired_at_ && now < *fired_at_ + period(sonar)) return std::nullopt;
  auto request = sonar.preview_request(PingNumber(number_ + 1), now);
  if (!request) return std::nullopt;
  ++number_;
  fired_at_ = now;
  busy_ = true;
  return request;
}

void Preview::done(bool made) {
  busy_ = false;
  if (made && on()) made_.add(*fired_at_);
}

void Preview::end() {
  until_.reset();
  made_ = {};  // the pause before the next preview must not count for the rate
}

namespace {

constexpr int fan_width_px = 720;
constexpr std::size_t most_points = 20000;
constexpr int arc_pieces = 16;
constexpr std::size_t plan_rows = 256;  // rows of a range image seen from above

ViewPayload::Piece piece(wire::Bytes bytes) { return {"", std::make_shared<const wire::Bytes>(std::move(bytes))}; }

ViewPayloadPointer picture(Time at, const std::string& frame, const foxglove::Image& image) {
  ViewPayload payload{at, {piece(foxglove::image_head(at, frame, image))}};
  payload.pieces.push_back({"", image.samples});
  return std::make_shared<const ViewPayload>(std::move(payload));
}

/// Returns a range image seen from above: the strongest pixel of each bearing and range.
PolarImage plan_of(const Ping& ping, double unit_m) {
  const RangeImageGrid grid(ping.request);
  PolarImage image;
  image.rows = plan_rows;
  image.beams = static_cast<std::size_t>(grid.columns);
  image.row_spacing_m = ping.request.settings.range_m / static_cast<double>(plan_rows);
  image.azimuth_rad.assign(ping.beam_azimuth_rad.begin(), ping.beam_azimuth_rad.end());
  image.samples.assign(image.rows * image.beams, 0);
  image.full_scale = static_cast<float>(ping.request.settings.format.max_code >> 16);
  for (std::size_t i = 0; i < ping.samples.size() / 4; ++i) {
    const RangePixel pixel = range_pixel(ping, i);
    const double level_m = pixel.range * unit_m * std::cos(grid.elevation_rad(static_cast<double>(i / image.beams)));
    const auto row = static_cast<std::size_t>(level_m / image.row_spacing_m);
    if (pixel.range == 0 || row >= image.rows) continue;
    float& sample = image.samples[row * image.beams + i % image.beams];
    sample = std::max(sample, std::min(image.full_scale, static_cast<float>(pixel.strength)));
  }
  return image;
}

foxglove::CloudPoint point_of(double range_m, double azimuth_rad, double elevation_rad, float part) {
  const double level_m = range_m * std::cos(elevation_rad);
  return {static_cast<float>(level_m * std::cos(azimuth_rad)), static_cast<float>(level_m * std::sin(azimuth_rad)),
          static_cast<float>(range_m * std::sin(elevation_rad)), static_cast<std::uint8_t>(std::lround(255 * part))};
}

/// Converts the returns of a range image to points in space. Strengths depend on range and ground, and some makes send no
/// strengths, so the threshold is a fraction of the strongest return.
std::vector<foxglove::CloudPoint> points_of(const Ping& ping, const RangeImageSettings& settings, double threshold) {
  const RangeImageGrid grid(ping.request);
  const std::size_t count = ping.samples.size() / 4, columns = static_cast<std::size_t>(grid.columns);
  std::uint32_t strongest = 1;
  for (std::size_t i = 0; i < count; ++i)
    if (const RangePixel pixel = range_pixel(ping, i); pixel.range != 0) strongest = std::max(strongest, pixel.strength);
  std::vector<foxglove::CloudPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    const RangePixel pixel = range_pixel(ping, i);
    const float part = static_cast<float>(pixel.strength) / static_cast<float>(strongest);
    if (pixel.range == 0 || part <= static_cast<float>(threshold)) continue;
    points.push_back(point_of(pixel.range * settings.range_unit_m, grid.azimuth_rad(static_cast<double>(i % columns)),
                              grid.elevation_rad(static_cast<double>(i / columns)), part));
  }
  return points;
}

}  // namespace

PolarImage polar_image_of(const Ping& ping, const Shades& shades) {
  const PingSettings& s = ping.request.settings;
  if (const RangeImageSettings* const range_image = range_image_of(ping.request)) return plan_of(ping, range_image->range_unit_m);
  PolarImage image;
  image.rows = static_cast<std::size_t>(s.range_bin_count);
  image.beams = static_cast<std::size_t>(s.beam_count);
  image.row_spacing_m = s.range_bin_m;
  image.start_m = s.range_start_m;
  image.azimuth_rad.assign(ping.beam_azimuth_rad.begin(), ping.beam_azimuth_rad.end());
  const auto bytes = static_cast<std::size_t>(s.format.bits / 8);
  image.samples.reserve(image.rows * image.beams);
  for (std::size_t i = 0; i < image.rows * image.beams; ++i)
    image.samples.push_back(static_cast<float>(sample_code(ping.samples, i, bytes)));
  image.full_scale = static_cast<float>(s.format.max_code);
  if (bytes > 1 && s.format.scale == SampleFormat::Scale::linear)
    image.shade(shades);  // because such samples are rarely near the maximum
  return image;
}

ViewPayloadPointer view_payload(Time at, wire::Bytes bytes) {
  return std::make_shared<const ViewPayload>(ViewPayload{at, {piece(std::move(bytes))}});
}

ViewPayloadPointer image_payload(const std::string& sonar, const PingPointer& ping) {
  return picture(ping->request.fired_at, sonar, foxglove::image_of(ping));
}

ViewPayloadPointer geometry_payload(const Ping& ping) {
  return view_payload(ping.request.fired_at, foxglove::geometry(ping, static_cast<std::uint32_t>(ping.request.number)));
}

ViewPayloadPointer truth_payload(const Ping& ping) { return view_payload(ping.request.fired_at, foxglove::truth(ping)); }

ViewPayloadPointer swath_payload(const std::string& sonar, const Ping& ping) {
  const PingSettings& s = ping.request.settings;
  const double half_height = static_cast<double>(ping.mode().pattern.elevation_width_rad) / 2;
  const double port = ping.beam_azimuth_rad.empty() ? 0 : static_cast<double>(ping.beam_azimuth_rad.front());
  const double starboard = ping.beam_azimuth_rad.empty() ? 0 : static_cast<double>(ping.beam_azimuth_rad.back());
  const auto at = [](double range, double azimuth, double elevation) {
    return Vec3d{range * std::cos(elevation) * std::cos(azimuth), range * std::cos(elevation) * std::sin(azimuth),
                 range * std::sin(elevation)};
  };
  foxglove::Lines lines{"swath/" + sonar, sonar, {}};
  const auto line = [&lines](Vec3d a, Vec3d b) { lines.points.insert(lines.points.end(), {a, b}); };
  for (const double azimuth : {port, starboard}) {
    for (const double elevation : {-half_height, half_height})
      line(at(s.range_start_m, azimuth, elevation), at(s.range_m, azimuth, elevation));
    for (const double range : {s.range_start_m, s.range_m})
      line(at(range, azimuth, -half_height), at(range, azimuth, half_height));
  }
  for (const double elevation : {-half_height, half_height}) {
    line(at(s.range_start_m, port, elevation), at(s.range_start_m, starboard, elevation));
    for (int i = 0; i < arc_pieces; ++i) {
      const auto azimuth = [&](int step) { return port + (starboard - port) * step / arc_pieces; };
      line(at(s.range_m, azimuth(i), elevation), at(s.range_m, azimuth(i + 1), elevation));
    }
  }
  ViewPayload payload{ping.request.fired_at, {piece(foxglove::scene_update(ping.request.fired_at, lines))}, true};
  payload.pieces.front().key = sonar;
  return std::make_shared<const ViewPayload>(std::move(payload));
}

FanStyle view_fan_style() {
  return {.width_px = fan_width_px, .colours = find_colour_map("gray").value_or(ColourMap{}), .rings = false};
}

ViewPayloadPointer fan_payload(const std::string& sonar, Time at, const SonarPicture& seen, PicturePainter& painter) {
  const auto fan = painter.draw(seen);
  if (!fan) return nullptr;
  auto samples = std::make_shared<wire::Bytes>();
  samples->reserve(fan->pixels.size());
  for (const Rgb& p : fan->pixels)  // pixels outside the picture have a colour that is not in the map
    samples->push_back(static_cast<std::byte>(p.r == p.g && p.g == p.b ? std::max<std::uint8_t>(1, p.r) : 0));
  return picture(at, sonar,
                 {static_cast<std::uint32_t>(fan->width), static_cast<std::uint32_t>(fan->height), "mono8", 1, samples});
}

ViewPayloadPointer picture_payload(Time at, const SonarPicture& picture) {
  return view_payload(at, foxglove::picture(picture, time_marks(picture)));
}

/// Keeps only the brightest samples, in any order; a viewer draws them as points.
ViewPayloadPointer cloud_payload(const std::string& sonar, const Ping& ping, double threshold) {
  if (const RangeImageSettings* const range_image = range_image_of(ping.request))
    return view_payload(ping.request.fired_at,
                        foxglove::cloud(ping.request.fired_at, sonar, points_of(ping, *range_image, threshold)));
  const PolarImage image = polar_image_of(ping);
  std::vector<std::pair<float, std::size_t>> bright;  // sample, index
  const auto least = static_cast<float>(threshold) * image.full_scale;
  for (std::size_t i = 0; i < image.samples.size(); ++i)
    if (image.samples[i] > least) bright.emplace_back(image.samples[i], i);
  if (bright.size() > most_points) {
    std::nth_element(bright.begin(), bright.begin() + most_points, bright.end(), std::greater<>());
    bright.resize(most_points);
  }
  std::vector<foxglove::CloudPoint> points;
  points.reserve(bright.size());
  for (const auto& [sample, i] : bright) {
    const double range = ping.request.settings.range_of_row(static_cast<double>(i / image.beams));
    const double azimuth = image.azimuth_rad[i % image.beams];
    const float part = std::min(1.0f, sample / image.full_scale);
    points.push_back({static_cast<float>(range * std::cos(azimuth)), static_cast<float>(range * std::sin(azimuth)), 0,
                      static_cast<std::uint8_t>(std::lround(255 * part))});
  }
  return view_payload(ping.request.fired_at, foxglove::cloud(ping.request.fired_at, sonar, points));
}

}  // namespace sonar
