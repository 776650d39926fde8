// The products. Sources: protocol/norbit/README.md.
#pragma once

#include <memory>
#include <span>

#include "core/sonar/sonar_model.hpp"

namespace sonar::norbit {

inline constexpr int bottom_beams = 256;                          // beams of bathymetry
inline constexpr double swath_deg = 140, beam_width_deg = 0.9;    // DFD; recalled
inline constexpr double sample_hz = 78125;                        // DFD
inline constexpr double farthest_m = 600, fastest_hz = 60;        // DFD
inline constexpr double frequency_khz = 400, bandwidth_khz = 80;  // DFD
inline constexpr int amplitude = 15, pulse_us = 500;              // DFD

/// Two products: one looks down, the other ahead.
std::span<const std::shared_ptr<const SonarModel>> models();
/// 0: forward, 1: bathymetry; as the sonar is mounted.
int mode_of(const SonarModel& model);

}  // namespace sonar::norbit
