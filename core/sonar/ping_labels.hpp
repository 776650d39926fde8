// Labels of a ping: for each sample, the object whose echo it contains (docs/datasets.md). core/pipeline/labels.hpp computes
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sonar {

/// Arrays are [rows][beams], as Ping::samples. Instance i + 1 is Scene::objects[i]; the point targets follow them.
struct PingLabels {
  int rows = 0, beams = 0;
  std::vector<std::uint16_t> instance;  // instance with the most energy, if above the receiver's noise; 0 = none
  std::vector<std::uint8_t> share;      // share of that instance in the sample's energy, noise included; 255 = all
  /// For samples without an instance: the nearest object that blocks the line of sight over the whole -3 dB width of the beam;
  /// 0 = no shadow. Echoes through the side lobes of the beam are ignored.
  std::vector<std::uint16_t> caster;
  /// [instance - 1]: fraction of the instance's energy that arrives, 0 to 1 (1 = nothing hides it); -1 for an object without a
  /// label.
  std::vector<float> visible;

  static constexpr std::size_t most_instances = 65535;
};

}  // namespace sonar
