// Pings whose messages contain complex samples.
#pragma once

#include "core/sonar/ping.hpp"

namespace sonar {

/// A ping with vendor settings of this type keeps the signals of its beams (Ping::beam_signal_upa), because the vendor's
/// message contains their phases.
struct PhasedSettings : VendorSettings {};

inline bool has_phases(const PingRequest& request) {
  return dynamic_cast<const PhasedSettings*>(request.vendor_settings.get()) != nullptr;
}

}  // namespace sonar
