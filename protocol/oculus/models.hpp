// A row for every Oculus product: profile name, part number, frequency modes. The physics uses only the SonarModel.
#pragma once

#include <memory>
#include <span>

#include "core/sonar/sonar_model.hpp"

namespace sonar::oculus {

/// Returns all profiles, the plain product of each family first. They are built once and never change.
std::span<const std::shared_ptr<const SonarModel>> models();

/// Returns the -3 dB width of the pulse in row spacings, with option `pulse: rows`; `mode` is an index into the model's modes.
double pulse_rows(const SonarModel& model, int mode);

}  // namespace sonar::oculus
