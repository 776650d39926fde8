#include "protocol/norbit/host.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/text/format.hpp"
#include "protocol/norbit/packet.hpp"
#include "protocol/norbit/settings.hpp"

namespace sonar::norbit {
namespace {

using protocol::HostActions;
using protocol::HostPing;
using text::format;

constexpr double usual_range_m = 10, usual_rate_hz = 10;
constexpr std::size_t most_parts = 2;

Bytes request_of(const protocol::SettingsOverride& wanted) {
  std::string text = format("set_range 0 %g\r\n", wanted.range_m.value_or(usual_range_m));
  if (wanted.gain_percent) text += format("set_gain %g\r\n", most_gain_db * *wanted.gain_percent / 100);
  const double rate_hz = wanted.rate_hz.value_or(usual_rate_hz);
  if (rate_hz != 0) text += format("set_rate %g\r\n", rate_hz);
  text += rate_hz == 0 ? "set_power 0\r\n" : "set_power 1\r\n";
  const auto bytes = std::as_bytes(std::span(text));
  return Bytes(bytes.begin(), bytes.end());
}

std::vector<std::pair<double, double>> points_of(const Bathymetry& bathymetry) {
  std::vector<std::pair<double, double>> points;
  for (const Beam& beam : bathymetry.beams) {
    const double azimuth = -static_cast<double>(beam.angle_rad), range_m = bathymetry.range_m(beam);
    if (beam.sample > 1 && std::isfinite(azimuth) && std::isfinite(range_m)) points.emplace_back(azimuth, range_m);
  }
  return points;
}

/// Angles rise from port to starboard, so that the beams are in the order of a picture. Nothing: they do not, or have no range.
std::optional<PolarImage> image_of(const Column& column) {
  PolarImage image;
  image.rows = column.front.samples;
  image.beams = column.front.beams;
  image.row_spacing_m = column.sample_m();
  image.start_m = std::max(0.0, (column.front.first_sample - 0.5) * image.row_spacing_m);  // a sample is in the middle of its row
  wire::Reader angles(column.directions);
  for (std::size_t n = 0; n < image.beams; ++n) {
    float angle = 0;
    angles("direction", angle);
    image.azimuth_rad.push_back(-static_cast<double>(angle));
    if (!std::isfinite(angle) || (n > 0 && !(image.azimuth_rad[n] < image.azimuth_rad[n - 1]))) return std::nullopt;
  }
  if (!(image.row_spacing_m > 0 && std::isfinite(image.row_spacing_m)) || image.rows < 1 || image.beams < 2) return std::nullopt;
  image.samples.resize(image.rows * image.beams);
  wire::Reader pixels(column.pixels);
  for (float& sample : image.samples) {
    std::uint16_t pixel = 0;
    pixels("pixel", pixel);
    sample = pixel;
  }
  image.full_scale = image.brightest(999);  // wide samples rarely come near their maximum
  return image;
}

class NorbitHost final : public protocol::Host {
 public:
  explicit NorbitHost(std::optional<Bytes> request) : request_(std::move(request)) {}

  HostActions on_open(std::span<const std::uint16_t>, Time) override {
    if (!request_) return {};
    return {protocol::HostSend{std::size(host_ports) - 1, *request_}};
  }
  HostActions on_bytes(std::size_t port, BytesView received, Time now) override {
    HostActions actions;
    auto& splitter = splitters_[std::min(port, splitters_.size() - 1)];  // a recording has the packets of all ports in one stream
    splitter.append(now, received);
    while (auto whole = splitter.next()) {
      if (auto bathymetry = read_bathymetry(whole->bytes)) {
        const std::uint32_t number = bathymetry->front.ping;
        Parts& parts = parts_[number];
        parts.bathymetry = std::move(bathymetry);
        parts.bathymetry_size = whole->bytes.size();
        on_part(number, actions);
      } else if (auto column = read_column(whole->bytes)) {
        const std::uint32_t number = column->front.ping;
        Parts& parts = parts_[number];
        parts.column_bytes = std::move(whole->bytes);  // a move keeps the bytes in their place
        parts.column = std::move(column);
        on_part(number, actions);
      } else if (port == 1) {  // others may hold replies to commands: a recording is one stream
        counts_.junk_bytes += whole->bytes.size();
      }
    }
    return actions;
  }
  std::string about() const override { return "a Norbit"; }
  std::optional<Counts> counts() const override { return counts_; }

 private:
  /// The packets of a ping come by two ports.
  struct Parts {
    std::optional<Bathymetry> bathymetry;
    std::size_t bathymetry_size = 0;
    Bytes column_bytes;
    std::optional<Column> column;  // reads column_bytes
  };
  /// A ping is whole with both; one whose other packet does not come is shown as it is.
  void on_part(std::uint32_t number, HostActions& actions) {
    ++counts_.messages;
    const bool is_whole = parts_[number].bathymetry && parts_[number].column;
    while (parts_.size() > most_parts || (is_whole && !parts_.empty() && parts_.begin()->first <= number)) {
      emit(parts_.begin()->second, actions);
      parts_.erase(parts_.begin());
    }
  }
  void emit(const Parts& parts, HostActions& actions) {
    HostPing ping;
    SonarPicture seen{.kind = PictureKind::points, .image = {}};
    ping.facts.bits = 16;
    if (parts.bathymetry) {
      const BathymetryFront& front = parts.bathymetry->front;
      seen.points = points_of(*parts.bathymetry);
      ping.facts.number = front.ping;
      ping.facts.beams = front.beams;
      ping.facts.rows = 1;
      ping.facts.frequency_hz = static_cast<double>(front.frequency_hz);
      ping.facts.message_size = parts.bathymetry_size;
      ping.fired_s = front.time_s;
      double nearest_m = 0, farthest_m = 0;
      for (const auto& [azimuth, range_m] : seen.points) {
        nearest_m = nearest_m == 0 ? range_m : std::min(nearest_m, range_m);
        farthest_m = std::max(farthest_m, range_m);
      }
      ping.facts.row_m = ping.facts.range_m = farthest_m;
      ping.facts.note =
          seen.points.empty() ? "no bottom" : format("%zu points from %.2f to %.2f m", seen.points.size(), nearest_m, farthest_m);
    }
    std::optional<PolarImage> image;
    if (parts.column) {
      const Column& column = *parts.column;
      const ColumnFront& front = column.front;
      ping.facts.number = front.ping;
      ping.facts.beams = front.beams;
      ping.facts.rows = front.samples;
      ping.facts.row_m = column.sample_m();
      ping.facts.range_m = (front.first_sample - 0.5 + static_cast<double>(front.samples)) * column.sample_m();
      ping.facts.frequency_hz = 1e3 * static_cast<double>(front.frequency_khz);
      ping.facts.message_size += parts.column_bytes.size();
      ping.fired_s = front.time_s;
      image = image_of(column);
      if (!image) ping.errors.emplace_back("the directions of the beams do not rise, or its samples have no range");
    }
    if (last_ && ping.facts.number > *last_ + 1) counts_.missing_pings += ping.facts.number - *last_ - 1;
    if (last_ && ping.facts.number <= *last_)
      ping.errors.push_back("number " + std::to_string(ping.facts.number) + " after " + std::to_string(*last_));
    last_ = ping.facts.number;
    if (image) seen.image = *image;
    ping.picture = [image]() -> Result<PolarImage> {
      if (image) return *image;
      return failure(ErrorKind::usage, "a picture needs the water column, port 2211: sonarctl listen prints the points");
    };
    if (image) ping.drawing = [seen = std::move(seen)] { return seen; };
    actions.emplace_back(std::move(ping));
  }

  std::optional<Bytes> request_;
  static recording::MessageSplitter splitter() { return {recording::Origin::device, framing}; }
  std::array<recording::MessageSplitter, 3> splitters_{splitter(), splitter(), splitter()};
  std::map<std::uint32_t, Parts> parts_;  // pings of which one packet has not arrived
  std::optional<std::uint32_t> last_;
  Counts counts_;
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto accepted = protocol::accept_settings(wanted, "a Norbit", {"range", "rate", "gain", "mode"}); !accepted)
    return tl::unexpected(accepted.error());
  if (wanted.settings.mode.value_or(0) > 0) return failure(ErrorKind::usage, "a Norbit has one mode only");
  return std::make_unique<NorbitHost>(wanted.as_it_is ? std::nullopt : std::optional(request_of(wanted.settings)));
}

}  // namespace sonar::norbit
