// A basin that uses every part of the model, and requests of two sonars. Each request has one change, and together they use
// every setting. Tests use them to compare whole pings.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/pipeline/pulses/spectral_transform.hpp"
#include "core/scene/files/load_scene.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {

// The basin has texture, a bed with another scattering law, smooth walls, smooth primitives and meshes, and bubbles.
inline constexpr const char* basin_yaml = R"(
materials:
  patchy: {law: gsab, texture: {shape: 2, correlation_m: 0.3}, grain: {shape: 1, correlation_m: 0.01}, trend_db_per_decade: 10}
  polished: {lambert_db: -20, roughness_m: 1.0e-5, reflection: 0.8}
  worn: {lambert_db: -20, roughness_m: 2.0e-4, reflection: 0.6}
objects:
  - {name: bed, type: plane, material: patchy, size_m: [5, 4], pose: {xyz_m: [2, 0, -1.6]}}
  - {name: wall, type: box, material: worn, size_m: [0.2, 4, 2], pose: {xyz_m: [4, 0, -1]}}
  - {name: side, type: box, material: polished, size_m: [5, 0.2, 2], pose: {xyz_m: [2, 1.6, -1]}}
  - {name: ball, type: sphere, material: polished, radius_m: 0.3, pose: {xyz_m: [3, -0.4, -1.2]}}
  - {name: ring, type: torus, material: worn, radius_m: 0.3, tube_radius_m: 0.1, pose: {xyz_m: [2.5, 0.7, -1.2], rpy_deg: [20, 70, 0]}}
  - {name: diver, type: capsule, material: worn, radius_m: 0.15, length_m: 0.6, moving: true, pose: {xyz_m: [3.5, 0.2, -1]}}
  - {name: mark, type: point, target_strength_db: -20, pose: {xyz_m: [2, -0.5, -1]}}
sea_surface: {roughness_m: 1.0e-4, bubble_layer_m: 0.3, bubble_loss_db_per_m: 5}
water_column: {clarity: turbid}
other_sonars: [{xyz_m: [3.5, -1, -0.8], level_db: 140, rate_hz: 200, pulse_ms: 0.4}]
)";

inline std::shared_ptr<const Scene> basin() {
  auto scene = parse_scene(basin_yaml, "basin", {});
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}

inline std::shared_ptr<const SonarModel> model_of(FrequencyMode mode, Waveform::Shape shape, bool exact) {
  mode.waveform.shape = shape;
  mode.waveform.exact = exact && spectral::have_transform;
  mode.receiver.crosstalk_db = -45;
  mode.receiver.leak_upa = 1e7f;
  mode.receiver.noise_width = 0.8f;
  mode.receiver.defocus = 1;
  mode.receiver.shared_noise = {.level_db = 20, .channels = 40, .group = 8, .steady = 0.3f, .focus_rows = 0.5f};
  mode.receiver.leak_is_shared = true;
  mode.receiver.truncates = true;
  mode.receiver.profile = {{-3, 1, -2}, {6, -4, 5}, 0.3f, {-0.1f, 0.2f, 0}};
  SonarModel model;
  model.name = "test";
  model.modes = {mode};
  return std::make_shared<const SonarModel>(std::move(model));
}

inline PingRequest request_of(std::shared_ptr<const SonarModel> model, std::uint32_t sonar_id) {
  PingRequest r;
  r.model = std::move(model);
  r.sonar_id = sonar_id;
  r.seed = Seed{7};
  r.number = PingNumber{sonar_id + 1};
  r.fired_at = Time(std::chrono::milliseconds(1000 + sonar_id));
  r.sonar_in_world = {{0, 0.1 * sonar_id, -1}, quat_from_rpy({0, 0.1, 0.05})};
  r.sonar_moves = {{1.5, 0.3, 0}, {0, 0.02, 0.5}};
  r.settings = default_rows(4.5, 90);
  r.settings.beam_count = 48;
  r.switches.multipath = r.switches.side_lobes = r.switches.interleave = true;
  r.switches.keep_pressure = r.switches.keep_beams = r.switches.keep_truth = true;
  return r;
}

// high() uses a sweep in the time domain, low() a tone in the frequency domain, at which `worn` reflects like a mirror.
inline PingRequest high() { return request_of(model_of(oculus_high(), Waveform::Shape::lfm, false), 0); }
inline PingRequest low() {
  PingRequest r = request_of(model_of(p900(), Waveform::Shape::cw, true), 1);
  r.settings.range_bin_count = 80;
  r.settings.samples_per_row = 2;
  r.settings.format = {.bits = 8, .max_code = 254, .gamma = 0.5f, .row_gains = true};
  return r;
}

/// Like basin(), but with beams three times as wide. These need a ninth of the cells and therefore much less time.
inline PingRequest with_wide_beams(PingRequest r) {
  SonarModel model = *r.model;
  model.modes[0].pattern.azimuth_width_rad *= 3;
  for (float& width : model.modes[0].beam_widths_rad) width *= 3;
  r.model = std::make_shared<const SonarModel>(std::move(model));
  return r;
}

/// Requests of both sonars, alternating: first with all parts on, then each with one change, finally with all parts on again.
inline std::vector<std::pair<std::string, PingRequest>> turns() {
  std::vector<std::pair<std::string, PingRequest>> all;
  const auto both = [&all](const std::string& what, const std::function<void(PingRequest&)>& change) {
    PingRequest a = high(), b = low();
    change(a), change(b);
    all.emplace_back(what + ", high", std::move(a));
    all.emplace_back(what + ", low", std::move(b));
  };
  both("everything", [](PingRequest&) {});
  both("expected power", [](PingRequest& r) { r.switches.expected_power = true; });
  both("everything again", [](PingRequest&) {});
  both("fixed fan", [](PingRequest& r) { r.switches.fixed_fan = 40; });
  both("blank", [](PingRequest& r) { r.blank = true; });
  both("flat beams", [](PingRequest& r) { r.switches.conical = false; });
  both("other seed", [](PingRequest& r) { r.seed = Seed{8}; });
  both("fewer beams and rows", [](PingRequest& r) { r.settings.beam_count = 33, r.settings.range_bin_count = 60; });
  both("a window of range", [](PingRequest& r) {
    r.settings.range_start_m = 30 * r.settings.range_bin_m;
    r.settings.range_bin_count -= 30;
  });
  both("listed beams, logarithmic samples", [](PingRequest& r) {
    SonarModel model = *r.model;
    FrequencyMode& mode = model.modes[0];
    mode.beam_spacing = BeamSpacing::listed;
    for (int j = 0; j < r.settings.beam_count; ++j) {
      const double x = 1 - (2.0 * j + 1) / r.settings.beam_count;
      mode.beam_azimuths_rad.push_back(static_cast<double>(mode.horizontal_aperture_rad) / 2 * (0.7 * x + 0.3 * x * x * x));
      mode.beam_widths_rad.push_back(mode.pattern.azimuth_width_rad * static_cast<float>(1 + x * x));
    }
    r.model = std::make_shared<const SonarModel>(std::move(model));
    r.settings.format = {.bits = 8, .max_code = 255, .scale = SampleFormat::Scale::logarithmic, .floor_db = -80, .ceiling_db = 0};
  });
  both("interleaved pings, channels of other gain", [](PingRequest& r) {
    SonarModel model = *r.model;
    model.modes[0].interleaved_pings = 3;
    model.modes[0].receiver.channel_gain_db = {1, -2, 3, 0};
    r.model = std::make_shared<const SonarModel>(std::move(model));
    r.settings.ping_interval_s = 0.02;
  });
  both("somewhere else", [](PingRequest& r) {
    r.sonar_in_world = {{1, -0.6, -0.7}, quat_from_rpy({0.1, -0.05, 0.2})};
    r.bodies_in_world = {{{2.8, -0.3, -0.9}, quat_from_rpy({0, 0.4, 0})}};
    r.settings.gain_db = 6;
  });
  for (std::size_t i = 0; i < named_switches.size(); ++i) {  // switches of the two sonars, alternating
    const NamedSwitch& part = named_switches[i];
    PingRequest r = i % 2 == 0 ? high() : low();
    r.switches.*part.is_on = !(r.switches.*part.is_on);
    all.emplace_back(std::string(part.name) + " switched", std::move(r));
  }
  both("beams that are not mixed", [](PingRequest& r) { r.switches.uneven = r.switches.defocus = false; });
  both("everything at last", [](PingRequest&) {});
  return all;
}

}  // namespace sonar::test
