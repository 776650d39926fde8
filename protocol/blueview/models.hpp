// The Teledyne BlueView products as SonarModel rows, and the preset the benchmark runs. No protocol hangs on them yet.
#pragma once

#include <memory>
#include <span>

#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar::blueview {

std::span<const std::shared_ptr<const SonarModel>> models();

/// The preset of the performance table: 10 m in 394 rows of 25.4 mm, 512 beams, pulse 25.4 mm.
PingSettings p900_90_preset();

}  // namespace sonar::blueview
