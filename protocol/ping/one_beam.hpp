// Refuses settings that sonars with one beam and one mode do not have.
#pragma once

#include <string>
#include <string_view>

#include "protocol/vendor.hpp"

namespace sonar::ping {

/// Returns the reason if a sonar with one beam, one mode and samples of `bits` does not have these settings, else an empty text.
/// `sonar`: name of the sonar, such as "a Ping360".
inline std::string one_beam_complaint(const protocol::SettingsOverride& wanted, std::string_view sonar, unsigned bits) {
  const std::string name(sonar);
  if (wanted.mode && *wanted.mode != 0) return name + " has one mode, 0";
  if (wanted.beams && *wanted.beams != 1) return name + " has one beam";
  if (wanted.sample_bits && *wanted.sample_bits != bits) return name + " sends samples of " + std::to_string(bits) + " bits";
  if (wanted.row_gains && *wanted.row_gains) return name + " sends no row gains";
  return {};
}

}  // namespace sonar::ping
