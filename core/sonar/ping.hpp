// One ping: everything it depends on (PingRequest) and what came back (Ping). A ping is a pure function of its request and the
// scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "core/sonar/water.hpp"

namespace sonar {

/// Parts of the model that can be switched (docs/acoustics.md, section 8). The defaults are the canonical model.
struct Switches {
  bool expected_power = false;  // |sum a|^2 replaced by sum |a|^2: deterministic radiometry
  bool noise = true;
  int fixed_fan = 0;           // n > 0: n uniform rays a column, one scatterer a ray, no cells
  bool keep_pressure = false;  // fill Ping::pressure_upa
};

struct PingRequest {
  std::shared_ptr<const SonarModel> model;
  PingNumber number{};
  Time fired_at{};
  Pose sonar_in_world;
  Pose vehicle_in_world;              // for the attitude and heading in packets
  std::vector<Pose> bodies_in_world;  // moving bodies, in the scene's order; empty = where the scene file put them
  Water water;
  PingSettings settings;
  std::uint64_t settings_id = 0;  // which client request these settings came from: the echo belongs to the ping
  std::uint32_t sonar_id = 0;     // keys the receiver noise
  Seed seed{};
  bool blank = false;  // no scene, noise only (on_stale: blank)
  Switches switches;
};

/// Vendor-neutral result. Rows by range, row 0 nearest; beam 0 = most to port (azimuth falls from + to -).
struct Ping {
  PingRequest request;
  std::vector<float> beam_azimuth_rad;  // [beams], positive to port
  std::vector<std::byte> samples;       // [rows][beams], little-endian, format.bits / 8 bytes each
  std::vector<std::uint32_t> row_gain;  // [rows] when format.row_gains: power gain applied to the row, at least 1
  std::vector<float> pressure_upa;      // [rows][beams] before TVG, when switches.keep_pressure

  const FrequencyMode& mode() const { return request.model->modes[static_cast<std::size_t>(request.settings.mode)]; }
};

}  // namespace sonar
