// Fuzzes the bytes of a sonar to the hosts of every make. Each host gets each input. A piece is a port, a length in two bytes,
// and bytes. At a port of kind http a piece is the body of a reply.
#include <algorithm>
#include <cstdlib>
#include <span>

#include "core/image/draw_picture.hpp"
#include "protocol/host.hpp"

namespace {

using namespace sonar;

/// Drops the host's requests; decoded pings must be whole.
void check(const protocol::HostActions& actions, std::size_t ports) {
  for (const protocol::HostAction& action : actions) {
    if (const auto* send = std::get_if<protocol::HostSend>(&action); send != nullptr && send->port >= ports) std::abort();
    const auto* ping = std::get_if<protocol::HostPing>(&action);
    if (ping == nullptr) continue;
    const auto picture = ping->picture();
    if (picture && (picture->samples.size() != picture->rows * picture->beams || picture->azimuth_rad.size() != picture->beams))
      std::abort();
    const auto drawing = protocol::drawing_of(*ping);
    if (drawing && drawing->image.samples.size() != drawing->image.rows * drawing->image.beams) std::abort();
    if (drawing) static_cast<void>(PicturePainter({.width_px = 64, .colours = colour_maps().front()}).draw(*drawing));
  }
}

void converse(const protocol::Make& make, const std::uint8_t* data, std::size_t size) {
  const auto host = *make.host({});
  const std::vector<std::uint16_t> own(make.ports.size(), 40000);
  Time now(std::chrono::seconds(1'700'000'000));
  check(host->on_open(own, now), own.size());
  for (std::size_t at = 0; at + 3 <= size;) {
    const std::size_t port = data[at] % own.size(), stated = data[at + 1] + 256u * data[at + 2];
    at += 3;
    const auto piece = std::as_bytes(std::span(data + at, std::min(size - at, stated)));
    at += piece.size();
    now += std::chrono::milliseconds(100);
    if (make.ports[port].kind == protocol::HostPort::Kind::http) {
      protocol::ResourceReply reply;
      reply.body.assign(reinterpret_cast<const char*>(piece.data()), piece.size());
      check(host->on_reply(reply, now), own.size());
    } else {
      check(host->on_bytes(port, piece, now), own.size());
    }
    check(host->on_tick(now), own.size());
    check(host->on_demand(now), own.size());
  }
  check(host->on_leave(), own.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const protocol::Make& make : protocol::makes()) converse(make, data, size);
  return 0;
}
