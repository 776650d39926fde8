// Replaces apertures and beam widths of a product, which no public source states, by those of the configuration. Called once
// per sonar, when its configuration is read; all other code uses the tuned model.
#pragma once

#include <memory>

#include "core/base/result.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// The model with the values of the options; without such options, the model itself. Error: a value for a mode that the product
/// lacks.
Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model, const protocol::OptionValues& options);

}  // namespace sonar::oculus
