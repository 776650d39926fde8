// The product and its mode. Sources: protocol/m3/README.md.
#pragma once

#include <memory>
#include <span>

#include "core/sonar/sonar_model.hpp"

namespace sonar::m3 {

inline constexpr int beam_count = 128;              // PKT
inline constexpr double beam_spacing_deg = 0.9375;  // PKT
inline constexpr double nearest_m = 0.2;            // PKT
inline constexpr double farthest_m = 150;           // recalled from the data sheet
inline constexpr float usual_rate_hz = 15;          // PKT
inline constexpr float highest_rate_hz = 40;        // recalled from the data sheet
inline constexpr double slowest_mps = 1400,
                        fastest_mps = 1560;  // sound speeds that a window covers; fitted to PKT, LOG

std::span<const std::shared_ptr<const SonarModel>> models();

}  // namespace sonar::m3
