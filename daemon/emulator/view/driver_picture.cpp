#include "daemon/emulator/view/driver_picture.hpp"

#include <algorithm>

#include "daemon/emulator/sonar/delivery.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"

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

}  // namespace sonar
