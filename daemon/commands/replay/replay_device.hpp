// The sonar of a recording: the recorded status datagram, with the local addresses, describes an Oculus; the vendor and the state
// of the device describe another make.
#pragma once

#include <memory>

#include "daemon/config/config.hpp"
#include "protocol/host.hpp"
#include "protocol/oculus/messages.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar {

/// An Oculus, which sends by itself, or a sonar that answers its hosts.
struct ReplayDevice {
  oculus::StatusMessage status;
  bool recorded_status = false;              // if false, it is made from the device id
  const protocol::Make* make = nullptr;      // null: an Oculus
  const protocol::Vendor* vendor = nullptr;  // the vendor of a device that answers requests, else null; and its state
  std::shared_ptr<protocol::DeviceState> state;
  std::uint32_t serial = 0;  // serial number of an ARIS
  std::string is_only_seen;  // reason if no driver can be served; empty = drivers can be served

  /// Null: it listens by TCP for connections that last.
  const protocol::Port* http() const { return vendor != nullptr ? vendor->port(protocol::Port::Kind::http) : nullptr; }
  bool by_datagrams() const { return vendor != nullptr && vendor->pings_by() == protocol::PingsBy::datagrams; }
  /// Its hosts decide which pings they get: RequestedReplay serves it, else ReplayServer.
  bool by_requests() const { return make != nullptr && make->codec.ping_part != nullptr; }
  std::string name() const;
  std::uint16_t tcp_port() const;
  /// 0: it sends no status.
  std::uint16_t status_port() const;
  /// 142 bytes of an Oculus: drivers connect to the address in it, and ignore a device of another id. Else the beacon.
  protocol::Bytes status_at(Ipv4 ip, Ipv4 mask, Ipv4 client) const;
};

/// Looks through the front of the recording and rewinds it. bad_data when there is no message of a device in it.
Result<ReplayDevice> find_replay_device(recording::RecordingReader& reader, const std::string& file, std::uint16_t part_number);

}  // namespace sonar
