#include "daemon/emulator/view/driver_picture.hpp"

#include <algorithm>

#include "daemon/emulator/view/ping_payloads.hpp"

namespace sonar {
namespace {

constexpr float dimmed = 0.4f;  // what the wire does not carry

/// The messages of a ping, over TCP or as datagrams.
std::vector<protocol::Bytes> messages_of(const Ping& ping, const protocol::Vendor& vendor, const protocol::DeviceState& state) {
  if (const auto framed = vendor.frame(ping, state)) return {*framed};
  for (const auto kind : {protocol::Port::Kind::udp_stream, protocol::Port::Kind::udp_dialogue})
    if (const protocol::Port* const port = vendor.port(kind)) return vendor.datagrams(*port, ping, state);
  return {};
}

}  // namespace

DriverPicture::DriverPicture(const protocol::Make& make) : make_(make) {
  if (make.picture == PictureKind::fan) return;
  protocol::Wanted wanted;
  wanted.as_it_is = true;
  if (auto host = make.host(wanted)) host_ = *std::move(host);
}

DriverPicture::Drawing DriverPicture::after(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state) {
  if (host_ == nullptr) return [ping] { return SonarPicture{.image = polar_image_of(*ping)}; };
  Drawing drawing;
  for (const protocol::Bytes& message : messages_of(*ping, *make_.device, state))
    for (const protocol::HostAction& action : host_->on_bytes(make_.ports.size() - 1, message, ping->request.fired_at))
      if (const auto* const read = std::get_if<protocol::HostPing>(&action)) drawing = read->drawing;
  if (make_.picture != PictureKind::points) return drawing;
  return [drawing, ping] {  // the water column is the model's own
    SonarPicture picture = drawing ? drawing() : SonarPicture{.kind = PictureKind::points, .image = {}};
    picture.image = polar_image_of(*ping);
    picture.image.full_scale /= dimmed;
    return picture;
  };
}

}  // namespace sonar
