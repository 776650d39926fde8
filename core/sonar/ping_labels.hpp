// Which object's echo each sample of a ping holds (docs/datasets.md); filled by core/pipeline/labels.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sonar {

/// Arrays are [rows][beams], as Ping::samples. Instance i + 1 is Scene::objects[i]; the point targets follow them.
struct PingLabels {
  int rows = 0, beams = 0;
  std::vector<std::uint16_t> instance;  // whose energy is largest, and above the receiver's noise; 0 = none
  std::vector<std::uint8_t> share;      // of that instance in the sample's energy, noise included, 255 = all
  /// Where no instance is: the object that cuts the line of sight over all of the beam's -3 dB width, while what comes into it
  /// from beside counts for nothing; 0 = no shadow.
  std::vector<std::uint16_t> caster;
  /// By instance, less 1, of objects with a label: energy that arrives over what would arrive were nothing in the way, 0 to 1;
  /// of others -1.
  std::vector<float> visible;

  static constexpr std::size_t most_instances = 65535;
};

}  // namespace sonar
