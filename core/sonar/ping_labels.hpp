// For each sample of a ping, the object whose echo it holds (docs/datasets.md); filled by core/pipeline/labels.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sonar {

/// Arrays are [rows][beams], as Ping::samples. Instance i + 1 is Scene::objects[i]; the point targets follow them.
struct PingLabels {
  int rows = 0, beams = 0;
  std::vector<std::uint16_t> instance;  // instance whose energy is largest, if above the receiver's noise; 0 = none
  std::vector<std::uint8_t> share;      // share of that instance in the sample's energy, noise included; 255 = all
  /// Where no instance is: the object, of several the nearest, that blocks the line of sight over all of the beam's -3 dB width;
  /// 0 = no shadow. What the beam receives there through its side lobes is ignored.
  std::vector<std::uint16_t> caster;
  /// [instance - 1]: the share of its energy that arrives, 0 to 1, where 1 means that nothing is in the way; -1 for an object
  /// without a label.
  std::vector<float> visible;

  static constexpr std::size_t most_instances = 65535;
};

}  // namespace sonar
