// The sonar of a recording. An Oculus is described by its recorded status datagram with our own addresses in it; a device of
// another make by its vendor and state.
#pragma once

#include <memory>

#include "daemon/config/config.hpp"
#include "protocol/host.hpp"
#include "protocol/oculus/messages.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar {

/// An Oculus, or a device of another make, which the code of its vendor emulates.
struct ReplayDevice {
  oculus::StatusMessage status;
  bool recorded_status = false;              // false: the status is made from the device id
  const protocol::Make* make = nullptr;      // null: an Oculus
  const protocol::Vendor* vendor = nullptr;  // null for an Oculus
  std::shared_ptr<protocol::DeviceState> state;
  std::uint32_t serial = 0;  // serial number of an ARIS
  std::string is_only_seen;  // reason why no driver can be served; empty = drivers can be served

  /// Returns the HTTP port; null if the device has none, and drivers keep a TCP connection open.
  const protocol::Port* http() const { return vendor != nullptr ? vendor->port(protocol::Port::Kind::http) : nullptr; }
  bool by_datagrams() const { return vendor != nullptr && vendor->pings_by() == protocol::PingsBy::datagrams; }
  /// True if hosts decide which pings they get; then RequestedReplay serves the device, else ReplayServer.
  bool by_requests() const { return make != nullptr && make->codec.ping_part != nullptr; }
  std::string name() const;
  std::uint16_t tcp_port() const;
  /// Returns 0 if the device sends no status.
  std::uint16_t status_port() const;
  /// Returns the status datagram. For an Oculus it has 142 bytes; drivers connect to the address in it, and ignore pings whose
  /// device id differs from the id in it. For other makes it is the beacon.
  protocol::Bytes status_at(Ipv4 ip, Ipv4 mask, Ipv4 client) const;
};

/// Searches the front of the recording for the device, and rewinds the recording. Error bad_data: there is no message of a
/// device.
Result<ReplayDevice> find_replay_device(recording::RecordingReader& reader, const std::string& file, std::uint16_t part_number);

}  // namespace sonar
