#include <algorithm>
#include <cmath>
#include <deque>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

namespace sonar::waterlinked {
namespace {

using Json = nlohmann::json;
using protocol::HostActions;

constexpr std::size_t picture_rows = 300;
constexpr double darkest = 0.85;  // fraction by which the farthest pixel of a range image is darker than the nearest
constexpr std::size_t most_pixels = 1 << 20;
constexpr std::string_view title = "a Sonar 3D-15", api = "/api/v1/integration";

/// Returns the carrier frequency of the shot's mode. The field `frequency` has the rate, so the horizontal field of view
/// identifies the mode.
double centre_hz_of(const Shot& shot) {
  for (const auto& mode : mode_rows())
    if (std::abs(mode.horizontal_deg - static_cast<double>(shot.horizontal_deg)) < 1) return mode.centre_hz;
  return 0;
}

}  // namespace

// The sizes come from the network, so they are checked before memory is reserved for a picture.
std::optional<protocol::HostPing> ping_from(const RangeMessage& ranges, const StrengthMessage* strengths) {
  const Shot& shot = ranges.shot;
  const std::size_t width = shot.width, height = shot.height;
  const double far_m = static_cast<double>(shot.range_m), scale_m = static_cast<double>(ranges.pixel_scale_m);
  const double wide = rad_from_deg(static_cast<double>(shot.horizontal_deg));
  const double high = rad_from_deg(static_cast<double>(shot.vertical_deg));
  if (width < 2 || height < 2 || width > most_pixels / height || ranges.pixels.size() != width * height) return std::nullopt;
  if (strengths != nullptr && strengths->pixels.size() != width * height) return std::nullopt;
  if (!(far_m > 0 && far_m < 1e4) || !(wide > 0 && wide < 2 * pi) || !std::isfinite(scale_m) || !std::isfinite(high))
    return std::nullopt;
  protocol::HostPing found;
  PolarImage image;
  image.rows = picture_rows;
  image.beams = width;
  image.row_spacing_m = far_m / picture_rows;
  image.samples.resize(image.rows * image.beams);
  SonarPicture seen{.kind = PictureKind::range_image, .image = {}, .elevation_rad = high / 2};
  seen.image.rows = height;
  seen.image.beams = width;
  seen.image.row_spacing_m = far_m / static_cast<double>(height);
  seen.image.samples.resize(width * height);
  std::size_t returns = 0;
  double nearest_m = far_m, farthest_m = 0;
  for (std::size_t column = 0; column < width; ++column) {
    image.azimuth_rad.push_back(wide * (0.5 - static_cast<double>(column) / static_cast<double>(width - 1)));
    for (std::size_t row = 0; row < height; ++row) {
      // Row 0 of the message is the lowest; row 0 of the drawing is the highest.
      const std::size_t pixel = row * width + column;
      if (ranges.pixels[pixel] == 0) continue;
      const double range_m = scale_m * ranges.pixels[pixel];
      ++returns;
      nearest_m = std::min(nearest_m, range_m);
      farthest_m = std::max(farthest_m, range_m);
      seen.image.samples[(height - 1 - row) * width + column] =
          static_cast<float>(255 * (1 - darkest * std::min(1.0, range_m / far_m)));
      const double elevation = high * (static_cast<double>(row) / static_cast<double>(height - 1) - 0.5);
      const double at = range_m * std::cos(elevation) / image.row_spacing_m;
      if (!(at >= 0 && at < static_cast<double>(picture_rows))) continue;
      float& sample = image.samples[static_cast<std::size_t>(at) * width + column];
      sample = std::max(sample, strengths == nullptr ? image.full_scale : static_cast<float>(strengths->pixels[pixel]));
    }
  }
  found.facts = {
      shot.sequence, static_cast<unsigned>(width), static_cast<unsigned>(height), 16, scale_m, far_m, centre_hz_of(shot), 0};
  found.facts.note =
      returns == 0 ? "no returns" : text::format("%zu returns from %.2f to %.2f m", returns, nearest_m, farthest_m);
  if (strengths == nullptr) found.facts.note += "; no strengths given";
  seen.image.azimuth_rad = image.azimuth_rad;
  seen.detections = returns;
  found.picture = [image = std::move(image)]() -> Result<PolarImage> { return image; };
  found.drawing = [seen = std::move(seen)] { return seen; };
  return found;
}

namespace {

/// Opens the sonar with HTTP requests, one after the other: GET /udp, then a POST for each setting (`posts_`). Images arrive as
/// datagrams: ranges, then the strengths of the same shot (`half_`).
class WaterlinkedHost final : public protocol::Host {
 public:
  explicit WaterlinkedHost(const protocol::Wanted& wanted) : may_set_(!wanted.as_it_is) {
    if (!may_set_) return;
    const protocol::SettingsOverride& s = wanted.settings;
    if (s.range_m) posts_.emplace_back("/acoustics/range", Json{{"min", 0}, {"max", *s.range_m}}.dump());
    if (s.mode) posts_.emplace_back("/acoustics/mode", Json(mode_rows()[*s.mode].name).dump());
    posts_.emplace_back("/acoustics/enabled", "true");
  }

  HostActions on_open(std::span<const std::uint16_t>, Time) override { return {ask("GET", "/udp", "")}; }

  /// Handles a reply, the first of which is that of GET /udp. If the output is disabled, the host switches multicast on, or fails
  /// if it may change no settings. If the output is unicast, the host does not change it, and fails. Then it sends the settings.
  HostActions on_reply(const protocol::ResourceReply& reply, Time) override {
    const auto fail = [](ErrorKind kind, std::string text) { return HostActions{Error{kind, std::move(text)}}; };
    if (!std::exchange(knows_output_, true)) {
      const Json udp = Json::parse(reply.body, nullptr, false);
      if (reply.status != 200 || !udp.is_object())
        return fail(ErrorKind::bad_data, "is not a Sonar 3D-15: " + asked_ + " returned " + std::to_string(reply.status));
      const Json mode = udp.value("mode", Json());
      if (mode == Json(unicast))
        return fail(ErrorKind::usage,
                    "the sonar sends its images to " + udp.dump() + " alone: set /udp to multicast to share them");
      if (mode != Json(multicast)) {
        if (!may_set_) return fail(ErrorKind::usage, "the sonar's UDP output is disabled: leave out --as-it-is to switch it on");
        posts_.emplace_front("/udp", Json{{"mode", multicast}}.dump());
      }
    } else if (reply.status / 100 != 2) {
      return fail(ErrorKind::usage, "the sonar refuses " + asked_ + ": " + reply.body);
    }
    if (posts_.empty()) {
      is_open_ = true;
      return {};
    }
    const auto [path, body] = std::move(posts_.front());
    posts_.pop_front();
    return {ask("POST", path, body)};
  }

  HostActions on_bytes(std::size_t, wire::BytesView datagram, Time) override {
    const auto content = rip_content(datagram);
    if (!content) return {};
    bytes_ += datagram.size();
    const Decoded decoded = decode(*content);
    std::optional<protocol::HostPing> ping;
    if (decoded.ranges) {
      // If the strengths of the previous shot were lost, its ranges make a ping without them.
      if (half_) ping = ping_from(*half_, nullptr);
      half_ = decoded.ranges;
    } else if (decoded.strengths && half_ && half_->shot.sequence == decoded.strengths->shot.sequence) {
      ping = ping_from(*std::exchange(half_, std::nullopt), &*decoded.strengths);
    }
    if (!ping) return {};
    ping->facts.message_size = std::exchange(bytes_, 0);
    return {*std::move(ping)};
  }

  bool is_open() const override { return is_open_; }
  std::string about() const override { return std::string(title); }

 private:
  protocol::ResourceRequest ask(const std::string& method, const std::string& path, const std::string& body) {
    asked_ = body.empty() ? path : path + " " + body;
    protocol::ResourceRequest request;
    request.method = method;
    request.path = std::string(api) + path;
    request.body = body;
    return request;
  }

  bool may_set_, knows_output_ = false, is_open_ = false;
  std::string asked_;                                      // the last request, for errors
  std::deque<std::pair<std::string, std::string>> posts_;  // path and body of the requests that are not sent yet
  std::optional<RangeMessage> half_;                       // ranges whose strengths have not arrived yet
  std::size_t bytes_ = 0;                                  // bytes received since the last ping
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto known = protocol::accept_settings(wanted, title, {"range", "mode"}); !known) return tl::unexpected(known.error());
  if (wanted.settings.mode && *wanted.settings.mode >= mode_rows().size())
    return failure(ErrorKind::usage, "a Sonar 3D-15 has modes 1 and 2");
  return std::make_unique<WaterlinkedHost>(wanted);
}

}  // namespace sonar::waterlinked
