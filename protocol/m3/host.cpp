#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/geometry.hpp"
#include "protocol/m3/m3.hpp"

namespace sonar::m3 {
namespace {

using protocol::HostActions;

/// Makes the picture. Positive angles are to port, as most clients assume (protocol/m3/README.md, "Left and right"). So the beam
/// with the largest angle, the last of the packet, is the first of the picture.
PolarImage picture_of(const Packet& packet) {
  PolarImage image;
  const DataFront& front = packet.header.front;
  image.rows = front.samples;
  image.beams = front.beams;
  image.row_spacing_m = packet.spacing_m();
  image.start_m = std::max(0.0, packet.start_m() - 0.5 * image.row_spacing_m);  // a sample is in the middle of its row
  for (std::size_t i = image.beams; i > 0; --i)
    image.azimuth_rad.push_back(rad_from_deg(static_cast<double>(packet.header.beam_deg[i - 1])));
  image.samples.resize(image.rows * image.beams);
  wire::Reader read(packet.samples);
  for (std::size_t beam = image.beams; beam > 0; --beam)
    for (std::size_t row = 0; row < image.rows; ++row) {
      float i = 0, q = 0;
      read("i", i);
      read("q", q);
      const float size = std::hypot(i, q);
      image.samples[row * image.beams + beam - 1] = std::isfinite(size) ? size : 0;
    }
  image.shade(shades);
  return image;
}

/// Returns the reason if the packet cannot be drawn, else an empty text.
std::string why_no_picture(const Packet& packet) {
  const auto& angles = packet.header.beam_deg;
  for (std::size_t i = 0; i < packet.header.front.beams; ++i)
    if (!(std::abs(angles[i]) <= 180) || (i > 0 && !(angles[i] > angles[i - 1]))) return "the angles of the beams do not rise";
  if (!(packet.spacing_m() > 0 && std::isfinite(packet.spacing_m()) && packet.start_m() >= 0 && std::isfinite(packet.start_m())))
    return "its samples have no range";
  return {};
}

/// Sends nothing: the maker's program streams to every client that connects (API).
class M3Host final : public protocol::Host {
 public:
  HostActions on_open(std::span<const std::uint16_t>, Time) override { return {}; }
  HostActions on_bytes(std::size_t, BytesView received, Time now) override {
    HostActions actions;
    splitter_.append(now, received);
    while (auto whole = splitter_.next()) {
      if (const auto packet = read_packet(whole->bytes)) {
        ++counts_.messages;
        actions.emplace_back(ping_from(*packet, std::move(whole->bytes)));
      } else {
        counts_.junk_bytes += whole->bytes.size();
      }
    }
    return actions;
  }
  std::string about() const override { return "an M3"; }
  std::optional<Counts> counts() const override { return counts_; }

 private:
  /// Makes a ping that keeps the packet, and computes the picture only on request.
  protocol::HostPing ping_from(const Packet& packet, Bytes whole) {
    const DataFront& front = packet.header.front;
    const DataBack& back = packet.header.back;
    protocol::HostPing ping;
    const double spacing_m = packet.spacing_m();
    ping.facts = {back.ping_number,
                  front.beams,
                  front.samples,
                  32,
                  spacing_m,
                  packet.start_m() + front.samples * spacing_m,
                  static_cast<double>(back.frequency_hz),
                  whole.size()};
    ping.fired_s = front.time_s + 1e-3 * front.time_ms;
    if (last_ && back.ping_number > *last_ + 1) counts_.missing_pings += back.ping_number - *last_ - 1;
    if (last_ && back.ping_number <= *last_)
      ping.errors.push_back("number " + std::to_string(back.ping_number) + " after " + std::to_string(*last_));
    last_ = back.ping_number;
    if (std::string why = why_no_picture(packet); !why.empty()) ping.errors.push_back(std::move(why));
    ping.picture = [kept = std::make_shared<const Bytes>(std::move(whole))]() -> Result<PolarImage> {
      const auto read = read_packet(*kept);
      if (std::string why = why_no_picture(*read); !why.empty()) return failure(ErrorKind::bad_data, "no picture: " + why);
      return picture_of(*read);
    };
    return ping;
  }

  recording::MessageSplitter splitter_{recording::Origin::device, framing};
  std::optional<std::uint32_t> last_;
  Counts counts_;
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto accepted = protocol::accept_settings(wanted, "an M3", {}); !accepted) return tl::unexpected(accepted.error());
  return std::make_unique<M3Host>();
}

}  // namespace sonar::m3
