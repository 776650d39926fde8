// The fire message for both ends: parsed from a client's bytes, or made by sonarctl.
// The device keeps it beside the settings (HeldFire), so that a ping echoes the request it was made with.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/sonar/ping.hpp"
#include "protocol/oculus/messages.hpp"

namespace sonar::oculus {

struct FireRequest {
  std::uint16_t version = 0;  // msg_version: 0 or 1 short, 2 long
  FireSettings settings;
  FireExtension extension;  // zero unless version 2
};

/// Parses a whole message. nullopt if it is too short to be a fire message; a missing tail of version 2 reads as 0.
std::optional<FireRequest> parse_fire(wire::BytesView message);

/// Exact bytes: 53 (versions 0, 1) or 89 (version 2 and above), payload size filled in unless `payload_size_zero`,
/// as several public clients send it.
wire::Bytes make_fire(const FireRequest& fire, std::uint16_t destination = 0, bool payload_size_zero = false);

/// The configuration stored in the device, which holds until a client sends a fire message. Its version is 0: the
/// short form fits every driver (docs/decisions/0025-oculus-evidence.md).
FireRequest stored_fire();

/// The request that a device's settings come from; equal when its bytes are.
struct HeldFire final : VendorSettings {
  explicit HeldFire(const FireRequest& from) : fire(from) {}
  bool equals(const VendorSettings& other) const override;
  FireRequest fire;
};
/// The request in `settings`; if they are null, stored_fire().
FireRequest fire_of(const VendorSettings* settings);

}  // namespace sonar::oculus
