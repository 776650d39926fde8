// Parses and makes fire messages. The device keeps the request (HeldFire), so that a ping can echo the request with which it
// was made.
#pragma once

#include <optional>

#include "core/sonar/ping.hpp"
#include "protocol/oculus/messages.hpp"

namespace sonar::oculus {

struct FireRequest {
  std::uint16_t version = 0;  // msg_version: 0 or 1 = short form, 2 = long form
  FireSettings settings;
  FireExtension extension;  // zeros before version 2
};

/// Parses a whole message; returns nullopt if it is too short to be a fire message. Missing fields of version 2 read as 0.
std::optional<FireRequest> parse_fire(wire::BytesView message);

/// Makes the message: 53 bytes (versions 0, 1) or 89 bytes (version 2 and above). `payload_size_zero`: the header states a
/// payload size of 0, as that of several public clients does.
wire::Bytes make_fire(const FireRequest& fire, std::uint16_t destination = 0, bool payload_size_zero = false);

/// Returns the configuration stored in the device, which is used until a client sends a fire message. Its version is 0, because
/// every driver can read the short form (docs/decisions/0025-oculus-evidence.md).
FireRequest stored_fire();

/// The request from which a device's settings were computed. Two requests are equal if their bytes are equal.
struct HeldFire final : VendorSettings {
  explicit HeldFire(const FireRequest& from) : fire(from) {}
  bool equals(const VendorSettings& other) const override;
  FireRequest fire;
};
/// Returns the request in `settings`; if it is null, stored_fire().
FireRequest fire_of(const VendorSettings* settings);

}  // namespace sonar::oculus
