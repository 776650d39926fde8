// Pings whose messages hold complex samples.
#pragma once

#include "core/sonar/ping.hpp"

namespace sonar {

/// Vendor settings that are of this type make a ping keep the signals of its beams (Ping::beam_signal_upa), whose phases its
/// message needs.
struct PhasedSettings : VendorSettings {};

inline bool has_phases(const PingRequest& request) {
  return dynamic_cast<const PhasedSettings*>(request.vendor_settings.get()) != nullptr;
}

}  // namespace sonar
