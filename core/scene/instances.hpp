// Names and classes of the instances in labels (core/sonar/ping.hpp).
#pragma once

#include <cstddef>
#include <string>

#include "core/scene/scene.hpp"

namespace sonar {

/// Objects come first, then point targets; `index` is the instance minus 1.
inline std::size_t instance_count(const Scene& scene) { return scene.objects.size() + scene.point_targets.size(); }

inline const std::string& instance_name(const Scene& scene, std::size_t index) {
  const std::size_t objects = scene.objects.size();
  return index < objects ? scene.objects[index].name : scene.point_targets.at(index - objects).name;
}

/// The label of the object, else the label of its first material, else the name of this material; "point" for points without a
/// label.
inline std::string instance_class(const Scene& scene, std::size_t index) {
  if (index >= scene.objects.size()) {
    const std::string& label = scene.point_targets.at(index - scene.objects.size()).label;
    return label.empty() ? "point" : label;
  }
  const Object& object = scene.objects[index];
  if (!object.label.empty()) return object.label;
  const std::size_t first = object.mesh && !object.mesh->material.empty() ? object.mesh->material.front() : 0;
  if (first >= scene.materials.size()) return {};
  const Material& material = scene.materials[first];
  return material.label.empty() ? material.name : material.label;
}

}  // namespace sonar
