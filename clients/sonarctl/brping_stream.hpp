// A host of the ping protocol (docs/protocols/ping.md) over one blocking socket: of a Surveyor or an Omniscan by TCP, of a
// Ping360 by UDP. Used by ping_stream.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/any_ping.hpp"
#include "clients/sonarctl/blueview_stream.hpp"
#include "clients/sonarctl/net.hpp"
#include "core/base/result.hpp"
#include "protocol/ping/messages.hpp"

namespace sonar::clients {

/// In that order.
enum class BrpingDevice { ping360, surveyor, omniscan };
inline constexpr std::uint16_t brping_ports[] = {12345, 62312, 51200};
inline constexpr const char* brping_names[] = {"a Ping360", "a Surveyor", "an Omniscan"};
/// Nothing: no such sonar is usual at that port.
std::optional<BrpingDevice> brping_device_at(std::uint16_t port);

class BrpingStream {
 public:
  /// Of a Ping360: a socket of its own; unavailable: nothing there answers within `patience`.
  static Result<Socket> find_ping360(const Endpoint& device, std::chrono::milliseconds patience);
  /// Asks for pings with these settings, range and rate and gain; nothing: for none.
  static Result<BrpingStream> open(Socket socket, BrpingDevice device, const std::optional<HeadRequest>& request);
  BrpingStream(BrpingStream&&) = default;
  BrpingStream& operator=(BrpingStream&&) = default;
  ~BrpingStream();  // a Ping360 does not scan on

  struct Item {
    Wait what = Wait::timed_out;
    std::optional<PicturePing> ping;  // with Wait::data
    std::string error;
  };
  Item next(std::chrono::milliseconds patience);
  /// True when the sonar closes the connection within `patience`: it serves another host.
  bool is_rejected(std::chrono::milliseconds patience) const {
    return device_ != BrpingDevice::ping360 && ends_without_a_byte(socket_, patience);
  }
  const char* about() const { return brping_names[static_cast<std::size_t>(device_)]; }

 private:
  BrpingStream(Socket socket, BrpingDevice device) : socket_(std::move(socket)), device_(device) {}
  std::optional<PicturePing> ping_from(const ping::Frame& frame);
  PicturePing line_of_scan(std::uint16_t angle, unsigned period, unsigned khz, wire::BytesView samples);

  Socket socket_;
  BrpingDevice device_;
  ping::Framer framer_{65535};
  PolarImage sector_;          // of a Ping360: as scanned so far
  std::vector<bool> scanned_;  // which beams of it
  std::uint32_t pings_ = 0;    // which a Ping360 does not number
  std::vector<std::byte> chunk_ = std::vector<std::byte>(1 << 16);
};

}  // namespace sonar::clients
