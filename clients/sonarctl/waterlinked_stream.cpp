#include "clients/sonarctl/waterlinked_stream.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "clients/sonarctl/http.hpp"
#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/waterlinked/rip.hpp"
#include "protocol/waterlinked/settings.hpp"

namespace sonar::clients {
namespace {

using Json = nlohmann::json;
using std::chrono::milliseconds;

constexpr std::size_t picture_rows = 300;
constexpr std::size_t most_pixels = 1 << 20;
constexpr int receive_buffer_bytes = 4 << 20;

/// The settings of one sonar over HTTP.
class Api {
 public:
  Api(Endpoint at, milliseconds patience) : at_(std::move(at)), patience_(patience) {}

  Result<Json> get(const std::string& path) const {
    auto reply = http_ask(at_, "GET", base + path, "", patience_);
    if (!reply) return tl::unexpected(reply.error());
    const Json value = Json::parse(reply->body, nullptr, false);
    if (reply->status == 200 && !value.is_discarded()) return value;
    return failure(ErrorKind::bad_data, "tcp " + text_from(at_) + " is no Sonar 3D-15: " + path + " is answered with " +
                                            std::to_string(reply->status));
  }
  Result<void> post(const std::string& path, const Json& value) const {
    auto reply = http_ask(at_, "POST", base + path, value.dump(), patience_);
    if (!reply) return tl::unexpected(reply.error());
    if (reply->status / 100 == 2) return {};
    return failure(ErrorKind::usage, "the sonar refuses " + path + " " + value.dump() + ": " + reply->body);
  }

 private:
  static inline const std::string base = "/api/v1/integration";
  Endpoint at_;
  milliseconds patience_;
};

Result<void> refuse_what_it_lacks(const HeadRequest& request) {
  std::vector<std::string> lacking = request.oculus_only;
  if (request.gain_percent) lacking.push_back("--gain");
  if (request.rate_hz) lacking.push_back("--rate");
  if (lacking.empty()) return {};
  return failure(ErrorKind::usage, lacking.front() + " does not apply to a Sonar 3D-15: it has --range and --mode");
}

/// Multicast, switched on when the output is disabled and settings are wanted.
Result<void> claim_images(const Api& api, bool may_set) {
  const auto udp = api.get("/udp");
  if (!udp) return tl::unexpected(udp.error());
  const Json mode = udp->is_object() ? udp->value("mode", Json()) : Json();
  if (mode == Json(waterlinked::multicast)) return {};
  if (mode == Json(waterlinked::unicast))
    return failure(ErrorKind::usage,
                   "the sonar sends its images to " + udp->dump() + " alone: set /udp to multicast to share them");
  if (!may_set) return failure(ErrorKind::usage, "the sonar's UDP output is disabled: leave out --as-it-is to switch it on");
  return api.post("/udp", {{"mode", waterlinked::multicast}});
}

Result<void> apply(const Api& api, const HeadRequest& request) {
  Result<void> done{};
  if (request.range_m) done = api.post("/acoustics/range", {{"min", 0}, {"max", *request.range_m}});
  if (done && request.head) {
    const auto modes = waterlinked::mode_rows();
    done = api.post("/acoustics/mode", modes[std::min(*request.head, modes.size() - 1)].name);
  }
  return done ? api.post("/acoustics/enabled", true) : done;
}

/// At the interface that reaches the device.
Result<Socket> join_group(const Endpoint& device, std::uint32_t& sonar_ip) {
  const auto towards = connect_udp(device);
  if (!towards) return tl::unexpected(towards.error());
  sockaddr_in ours{}, theirs{};
  socklen_t size = sizeof ours;
  ::getsockname(towards->fd(), reinterpret_cast<sockaddr*>(&ours), &size);
  size = sizeof theirs;
  ::getpeername(towards->fd(), reinterpret_cast<sockaddr*>(&theirs), &size);
  sonar_ip = theirs.sin_addr.s_addr;
  const auto& [group, port] = waterlinked::multicast_group;
  auto socket = listen_udp(Endpoint{text::format_ipv4(group), port});
  if (!socket) return socket;
  ip_mreq wanted{};
  ::inet_pton(AF_INET, text::format_ipv4(group).c_str(), &wanted.imr_multiaddr);
  wanted.imr_interface = ours.sin_addr;
  if (::setsockopt(socket->fd(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &wanted, sizeof wanted) != 0)
    return failure(ErrorKind::unavailable, std::string("cannot join the sonar's multicast group: ") + std::strerror(errno));
  ::setsockopt(socket->fd(), SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  return socket;
}

double centre_hz_of(const waterlinked::Shot& shot) {
  for (const auto& mode : waterlinked::mode_rows())
    if (std::abs(mode.horizontal_deg - static_cast<double>(shot.horizontal_deg)) < 1) return mode.centre_hz;
  return 0;
}

}  // namespace

std::optional<PicturePing> ping_from(const waterlinked::RangeMessage& ranges, const waterlinked::StrengthMessage* strengths) {
  const waterlinked::Shot& shot = ranges.shot;
  const std::size_t columns = shot.width, rows = shot.height;
  const double far_m = static_cast<double>(shot.range_m), scale_m = static_cast<double>(ranges.pixel_scale_m);
  const double wide = rad_from_deg(static_cast<double>(shot.horizontal_deg));
  const double high = rad_from_deg(static_cast<double>(shot.vertical_deg));
  if (columns < 2 || rows < 2 || columns > most_pixels / rows || ranges.pixels.size() != columns * rows) return std::nullopt;
  if (strengths != nullptr && strengths->pixels.size() != columns * rows) return std::nullopt;
  if (!(far_m > 0 && far_m < 1e4) || !(wide > 0 && wide < 2 * pi) || !std::isfinite(scale_m) || !std::isfinite(high))
    return std::nullopt;
  PicturePing found;
  PolarImage& image = found.image;
  image.rows = picture_rows;
  image.beams = columns;
  image.row_spacing_m = far_m / picture_rows;
  image.samples.resize(image.rows * image.beams);
  std::size_t returns = 0;
  double nearest_m = far_m, farthest_m = 0;
  for (std::size_t column = 0; column < columns; ++column) {
    image.azimuth_rad.push_back(wide * (0.5 - static_cast<double>(column) / static_cast<double>(columns - 1)));
    for (std::size_t row = 0; row < rows; ++row) {
      const std::size_t pixel = row * columns + column;
      if (ranges.pixels[pixel] == 0) continue;
      const double range_m = scale_m * ranges.pixels[pixel];
      ++returns;
      nearest_m = std::min(nearest_m, range_m);
      farthest_m = std::max(farthest_m, range_m);
      const double elevation = high * (static_cast<double>(row) / static_cast<double>(rows - 1) - 0.5);
      const double at = range_m * std::cos(elevation) / image.row_spacing_m;
      if (!(at >= 0 && at < static_cast<double>(picture_rows))) continue;
      float& sample = image.samples[static_cast<std::size_t>(at) * columns + column];
      sample = std::max(sample, strengths == nullptr ? image.full_scale : static_cast<float>(strengths->pixels[pixel]));
    }
  }
  found.facts = {
      shot.sequence, static_cast<unsigned>(columns), static_cast<unsigned>(rows), 16, scale_m, far_m, centre_hz_of(shot), 0};
  found.facts.note =
      returns == 0 ? "no returns" : text::format("%zu returns from %.2f to %.2f m", returns, nearest_m, farthest_m);
  if (strengths == nullptr) found.facts.note += ", without their strengths";
  return found;
}

Result<WaterlinkedStream> WaterlinkedStream::open(const Endpoint& device, const std::optional<HeadRequest>& request,
                                                  milliseconds patience) {
  if (request)
    if (auto possible = refuse_what_it_lacks(*request); !possible) return tl::unexpected(possible.error());
  const Api api(device, patience);
  std::uint32_t sonar_ip = 0;
  auto images = join_group(device, sonar_ip);
  if (!images) return tl::unexpected(images.error());
  if (auto claimed = claim_images(api, request.has_value()); !claimed) return tl::unexpected(claimed.error());
  if (request)
    if (auto applied = apply(api, *request); !applied) return tl::unexpected(applied.error());
  return WaterlinkedStream(*std::move(images), sonar_ip);
}

std::optional<PicturePing> WaterlinkedStream::take(wire::BytesView datagram) {
  const auto content = waterlinked::rip_content(datagram);
  if (!content) return std::nullopt;
  bytes_ += datagram.size();
  const waterlinked::Decoded decoded = waterlinked::decode(*content);
  std::optional<PicturePing> ping;
  if (decoded.ranges) {
    if (half_) ping = ping_from(*half_, nullptr);
    half_ = decoded.ranges;
  } else if (decoded.strengths && half_ && half_->shot.sequence == decoded.strengths->shot.sequence) {
    ping = ping_from(*std::exchange(half_, std::nullopt), &*decoded.strengths);
  }
  if (ping) ping->facts.message_size = std::exchange(bytes_, 0);
  return ping;
}

WaterlinkedStream::Item WaterlinkedStream::next(milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  for (;;) {
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - std::chrono::steady_clock::now());
    const Datagram datagram = receive_from(images_, chunk_, std::max(left, milliseconds(0)));
    if (datagram.what != Wait::data) return {datagram.what, {}, datagram.error};
    const std::size_t size = datagram.ip == sonar_ip_ ? datagram.size : 0;  // others' datagrams are nothing to us
    if (auto ping = take(wire::BytesView(chunk_).first(size))) return {Wait::data, std::move(ping), {}};
    if (std::chrono::steady_clock::now() >= deadline) return {Wait::timed_out, {}, {}};
  }
}

}  // namespace sonar::clients
