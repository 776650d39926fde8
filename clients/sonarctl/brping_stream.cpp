#include "clients/sonarctl/brping_stream.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "protocol/ping/omniscan_messages.hpp"

namespace sonar::clients {
namespace {

using std::chrono::milliseconds;
using text::format;

constexpr double sample_unit_s = 25e-9, sound_mps = 1500;
constexpr int grads = 400, sector = 201, first_grad = 300;  // of a scan: half a circle, port to starboard
constexpr double usual_range_m = 10;
constexpr std::size_t point_rows = 300;  // of a picture of points

wire::Bytes request_of(BrpingDevice device, const HeadRequest& head) {
  const double range_m = head.range_m.value_or(usual_range_m), gain = head.gain_percent.value_or(0) / 100;
  const double period_ms = head.rate_hz && *head.rate_hz > 0 ? std::clamp(1000 / *head.rate_hz, 1.0, 30000.0) : 0;
  if (device == BrpingDevice::surveyor) {
    ping::PingParameters p{.end_mm = static_cast<std::int32_t>(std::lround(1000 * range_m)), .enable = 1, .yz = 1, .atof = 0};
    if (head.gain_percent) p.gain = static_cast<std::int16_t>(std::lround(100 * gain));
    if (period_ms > 0) p.period_ms = static_cast<std::int16_t>(std::lround(period_ms));
    return ping::framed_message(ping::Id::set_ping_parameters, 0, p);
  }
  if (device == BrpingDevice::omniscan) {
    ping::OsPingParams p{.length_mm = static_cast<std::uint32_t>(std::lround(1000 * range_m)), .enable = 1};
    p.period_ms = static_cast<std::uint32_t>(std::lround(head.rate_hz ? period_ms : 100));
    if (head.gain_percent) p.gain = static_cast<std::int16_t>(std::lround(7 * gain));
    return ping::framed_message(ping::Id::os_ping_params, 0, p);
  }
  ping::AutoTransmit t;
  const double window = 2 * range_m / sound_mps / sample_unit_s;  // in units of the sample period
  t.samples = static_cast<std::uint16_t>(std::clamp(window / 80, 200.0, 1000.0));
  t.period = static_cast<std::uint16_t>(std::clamp(window / t.samples, 80.0, 40000.0));
  t.transmit_us = static_cast<std::uint16_t>(std::clamp(8000 * range_m / sound_mps, 5.0, 500.0));  // the makers' rule
  t.khz = 750;
  t.gain = static_cast<std::uint8_t>(std::lround(2 * gain));
  t.start = first_grad;
  t.stop = (first_grad + sector - 1) % grads;
  return ping::framed_message(ping::Id::auto_transmit, 0, t);
}

/// Of a message that is followed by others of the payload.
template <class M>
std::optional<wire::BytesView> read_front(const ping::Frame& frame, M& message) {
  wire::Reader reader(frame.payload);
  fields(reader, message);
  if (!reader.ok()) return std::nullopt;
  return wire::BytesView(frame.payload).subspan(wire::wire_size<M>());
}

PicturePing points_of(const ping::YzPointData& data, wire::BytesView rest) {
  PicturePing found;
  std::vector<std::pair<double, double>> polar;  // azimuth, range
  wire::Reader reader(rest);
  for (int i = 0; i < data.points; ++i) {
    float y = 0, z = 0;
    reader("y", y);
    reader("z", z);
    if (!reader.ok() || !std::isfinite(y) || !std::isfinite(z)) break;
    polar.emplace_back(std::atan2(static_cast<double>(y), -static_cast<double>(z)),
                       std::hypot(static_cast<double>(y), static_cast<double>(z)));
  }
  std::sort(polar.begin(), polar.end(), std::greater<>());
  polar.erase(std::unique(polar.begin(), polar.end(), [](auto a, auto b) { return a.first == b.first; }), polar.end());
  PolarImage& image = found.image;
  image.rows = point_rows;
  image.beams = polar.size();
  image.row_spacing_m = static_cast<double>(data.end_m) / point_rows;
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
  found.facts = {data.ping,
                 static_cast<unsigned>(polar.size()),
                 1,
                 32,
                 static_cast<double>(data.end_m),
                 static_cast<double>(data.end_m),
                 240e3,
                 0};
  found.facts.note = polar.empty() ? "no points" : format("points from %.2f to %.2f m", nearest_m, farthest_m);
  return found;
}

PicturePing profile_of(const ping::OsMonoProfile& data, wire::BytesView rest) {
  PicturePing found;
  PolarImage& image = found.image;
  image.start_m = 1e-3 * data.start_mm;
  image.beams = 1;
  image.azimuth_rad = {0};
  image.full_scale = 65535;
  wire::Reader reader(rest);
  for (std::uint16_t i = 0, power = 0; i < data.results && reader.ok(); ++i) {
    reader("power", power);
    if (reader.ok()) image.samples.push_back(power);
  }
  image.rows = image.samples.size();
  image.row_spacing_m = 1e-3 * data.length_mm / std::max<double>(data.results, 1);
  found.facts = {
      data.ping, 1, static_cast<unsigned>(image.rows), 16, image.row_spacing_m, image.range_m(), static_cast<double>(data.hz), 0};
  if (image.rows == 0) return found;
  const auto top = std::max_element(image.samples.begin(), image.samples.end());
  const double db = static_cast<double>(data.lowest_db) +
                    static_cast<double>(*top) / 65535 * static_cast<double>(data.highest_db - data.lowest_db);
  found.facts.note = format("strongest %.1f dB at %.2f m", db,
                            image.start_m + (static_cast<double>(top - image.samples.begin()) + 0.5) * image.row_spacing_m);
  return found;
}

}  // namespace

std::optional<BrpingDevice> brping_device_at(std::uint16_t port) {
  const auto found = std::find(std::begin(brping_ports), std::end(brping_ports), port);
  if (found == std::end(brping_ports)) return std::nullopt;
  return static_cast<BrpingDevice>(found - std::begin(brping_ports));
}

Result<Socket> BrpingStream::find_ping360(const Endpoint& device, milliseconds patience) {
  auto socket = connect_udp(device);
  if (!socket) return socket;
  std::array<std::byte, 2> wanted{std::byte{5}};  // its protocol version: nothing changes
  std::array<std::byte, 4096> answer;
  const auto asked = write_all(*socket, ping::framed(ping::Id::general_request, 0, wanted));
  if (asked && read_some(*socket, answer, patience).what == Wait::data) return socket;
  return failure(ErrorKind::unavailable, "no Ping360 answers at udp " + text_from(device) +
                                             ". Is sonard running there? Its banner names the address of each sonar");
}

Result<BrpingStream> BrpingStream::open(Socket socket, BrpingDevice device, const std::optional<HeadRequest>& request) {
  BrpingStream stream(std::move(socket), device);
  if (request)
    if (auto sent = write_all(stream.socket_, request_of(device, *request)); !sent) return tl::unexpected(sent.error());
  return stream;
}

BrpingStream::~BrpingStream() {
  if (socket_.fd() >= 0 && device_ == BrpingDevice::ping360)
    static_cast<void>(write_all(socket_, ping::framed(ping::Id::motor_off, 0, {})));
}

PicturePing BrpingStream::line_of_scan(std::uint16_t angle, unsigned period, unsigned khz, wire::BytesView samples) {
  const double row_m = period * sample_unit_s * sound_mps / 2;
  if (sector_.rows != samples.size() || sector_.row_spacing_m != row_m) {
    sector_ = {};
    sector_.rows = samples.size();
    sector_.beams = sector;
    sector_.row_spacing_m = row_m;
    for (int i = 0; i < sector; ++i) sector_.azimuth_rad.push_back((sector / 2 - i) * 2 * pi / grads);
    sector_.samples.resize(sector_.rows * sector_.beams);
    scanned_.assign(sector, false);
  }
  const auto beam = static_cast<std::size_t>((angle + grads - first_grad) % grads);
  if (beam < sector_.beams) {
    scanned_[beam] = true;
    for (std::size_t row = 0; row < sector_.rows; ++row)
      sector_.samples[row * sector_.beams + beam] = static_cast<float>(std::to_integer<int>(samples[row]));
  }
  PicturePing ping{sector_, {}, std::find(scanned_.begin(), scanned_.end(), false) == scanned_.end()};
  ping.facts = {++pings_, 1, static_cast<unsigned>(samples.size()), 8, row_m, sector_.range_m(), 1e3 * khz, 0};
  ping.facts.note = "angle " + std::to_string(angle) + " grad";
  return ping;
}

std::optional<PicturePing> BrpingStream::ping_from(const ping::Frame& frame) {
  const auto counted = [](wire::BytesView rest, std::size_t count) { return rest.first(std::min(rest.size(), count)); };
  switch (frame.header.id) {
    case ping::Id::auto_device_data: {
      ping::AutoDeviceData data;
      const auto rest = read_front(frame, data);
      if (!rest || data.count == 0) return std::nullopt;
      return line_of_scan(data.angle, data.period, data.khz, counted(*rest, data.count));
    }
    case ping::Id::device_data: {
      ping::DeviceData data;
      const auto rest = read_front(frame, data);
      if (!rest || data.count == 0) return std::nullopt;
      return line_of_scan(data.angle, data.period, data.khz, counted(*rest, data.count));
    }
    case ping::Id::yz_point_data: {
      ping::YzPointData data;
      const auto rest = read_front(frame, data);
      return rest ? std::optional(points_of(data, *rest)) : std::nullopt;
    }
    case ping::Id::os_mono_profile: {
      ping::OsMonoProfile data;
      const auto rest = read_front(frame, data);
      return rest ? std::optional(profile_of(data, *rest)) : std::nullopt;
    }
    default:
      return std::nullopt;
  }
}

BrpingStream::Item BrpingStream::next(milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  for (;;) {
    while (auto frame = framer_.next()) {
      if (!frame->sum_is_right) continue;
      if (frame->header.id == ping::Id::nack) {
        std::string why;
        for (std::size_t i = 2; i < frame->payload.size(); ++i) why += static_cast<char>(frame->payload[i]);
        return {Wait::closed, {}, "the sonar refused a request: " + why};
      }
      if (auto ping = ping_from(*frame)) {
        ping->facts.message_size = ping::header_size + frame->payload.size() + ping::sum_size;
        return {Wait::data, std::move(ping), {}};
      }
    }
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - std::chrono::steady_clock::now());
    const Read read = read_some(socket_, chunk_, std::max(left, milliseconds(0)));
    if (read.what != Wait::data) return {read.what, {}, read.error};
    framer_.append(std::span<const std::byte>(chunk_).first(read.size));
  }
}

}  // namespace sonar::clients
