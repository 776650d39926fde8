// The data that each part of the model needs from a scene and a sonar, and typical values for scenes and sonars without them, so
// that the cost of every part can be measured over every scene.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar::bench {

/// Names of the parts whose data can be added: texture, volume, crosstalk, leak.
std::vector<std::string> parts_to_give();

/// Adds only missing data.
std::shared_ptr<const Scene> with_parts(std::shared_ptr<const Scene> scene, const std::vector<std::string>& parts);
std::shared_ptr<const SonarModel> with_parts(std::shared_ptr<const SonarModel> model, const std::vector<std::string>& parts);

/// Returns those of parts_to_give() that the scene and the sonar already have.
std::vector<std::string> parts_had(const Scene& scene, const FrequencyMode& mode);

}  // namespace sonar::bench
