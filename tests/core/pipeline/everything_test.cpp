// Every part of the model at once: two sonars take turns in one engine, and each ping is the same bytes whoever computes it and
// whatever came before. And a part that is switched off is as if its data were not there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/pulses/spectral_transform.hpp"
#include "core/scene/files/load_scene.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

// A basin with something of everything: texture, a bed by another law, smooth walls, smooth primitives and meshes, bubbles.
constexpr const char* basin_yaml = R"(
materials:
  patchy: {law: gsab, texture: {shape: 2, correlation_m: 0.3}, trend_db_per_decade: 10}
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

std::shared_ptr<const Scene> basin() {
  auto scene = parse_scene(basin_yaml, "basin", {});
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}

std::shared_ptr<const SonarModel> model_of(FrequencyMode mode, Waveform::Shape shape, bool exact) {
  mode.waveform.shape = shape;
  mode.waveform.exact = exact && spectral::have_transform;
  mode.receiver.crosstalk_db = -45;
  mode.receiver.leak_upa = 1e7f;
  SonarModel model;
  model.name = "test";
  model.modes = {mode};
  return std::make_shared<const SonarModel>(std::move(model));
}

PingRequest request_of(std::shared_ptr<const SonarModel> model, std::uint32_t sonar_id) {
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
  r.switches.multipath = true;
  r.switches.keep_pressure = r.switches.keep_beams = r.switches.keep_truth = true;
  return r;
}

// Sweeps in the time domain, tones by way of the spectrum; the second is at home where `worn` mirrors.
PingRequest high() { return request_of(model_of(oculus_high(), Waveform::Shape::lfm, false), 0); }
PingRequest low() {
  PingRequest r = request_of(model_of(p900(), Waveform::Shape::cw, true), 1);
  r.settings.range_bin_count = 80;
  r.settings.samples_per_row = 2;
  r.settings.format = {.bits = 8, .max_code = 254, .gamma = 0.5f, .row_gains = true};
  return r;
}

std::string bytes_of(const Ping& ping) {
  std::string all;
  const auto add = [&all](const auto& values) {
    all.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
  };
  add(ping.samples), add(ping.pressure_upa), add(ping.beam_signal_upa), add(ping.row_gain), add(ping.truth);
  return all;
}

class Engine {
 public:
  explicit Engine(std::shared_ptr<const Scene> scene, int threads = 1)
      : pool_(threads), engine_(make_cpu_engine(std::move(scene), pool_)) {}
  Ping ping(const PingRequest& request) { return engine_->run({&request, 1}).at(0); }

 private:
  Parallel pool_;
  std::unique_ptr<PingEngine> engine_;
};

/// What two sonars may ask one after the other: all at once, then one thing changed at a time, and back.
std::vector<std::pair<std::string, PingRequest>> turns() {
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
  both("somewhere else", [](PingRequest& r) {
    r.sonar_in_world = {{1, -0.6, -0.7}, quat_from_rpy({0.1, -0.05, 0.2})};
    r.bodies_in_world = {{{2.8, -0.3, -0.9}, quat_from_rpy({0, 0.4, 0})}};
    r.settings.gain_db = 6;
  });
  for (std::size_t i = 0; i < named_switches.size(); ++i) {  // of one sonar and the other in turn
    const NamedSwitch& part = named_switches[i];
    PingRequest r = i % 2 == 0 ? high() : low();
    r.switches.*part.is_on = !(r.switches.*part.is_on);
    all.emplace_back(std::string(part.name) + " switched", std::move(r));
  }
  both("everything at last", [](PingRequest&) {});
  return all;
}

TEST(Everything, IsTheSameBytesForAnyNumberOfThreadsAndWhateverCameBefore) {
  const std::shared_ptr<const Scene> scene = basin();
  Engine one(scene, 1), two(scene, 2), four(scene, 4);
  for (const auto& [what, request] : turns()) {
    const Ping ping = one.ping(request);
    const std::string bytes = bytes_of(ping);
    EXPECT_TRUE(bytes == bytes_of(two.ping(request))) << what << ": 2 threads";
    if (what.starts_with("everything")) {
      EXPECT_TRUE(bytes == bytes_of(four.ping(request))) << what << ": 4 threads";
    }
    if (!what.ends_with("switched")) {
      EXPECT_TRUE(bytes == bytes_of(Engine(scene).ping(request))) << what << ": nothing before it";
    }
    EXPECT_TRUE(std::all_of(ping.pressure_upa.begin(), ping.pressure_upa.end(), [](float p) { return std::isfinite(p); }))
        << what;
  }
}

// The counter-check: each part is in those bytes.
TEST(Everything, LacksSomethingWithoutAnyOneOfItsParts) {
  Engine engine(basin());
  for (const PingRequest& whole : {high(), low()}) {
    const std::string with_all = bytes_of(engine.ping(whole));
    for (const NamedSwitch& part : named_switches) {
      if (part.is_on == &Switches::doppler && whole.model->modes[0].waveform.shape != Waveform::Shape::lfm) continue;
      PingRequest without = whole;
      without.switches.*part.is_on = false;
      EXPECT_TRUE(with_all != bytes_of(engine.ping(without))) << part.name;
    }
  }
}

TEST(Everything, SwitchedOffIsAsIfItsDataWereNotThere) {
  const std::shared_ptr<const Scene> whole = basin();
  const auto same = [&](bool Switches::*part, const std::function<void(Scene&)>& without,
                        const std::function<void(PingRequest&)>& change) {
    auto bare = std::make_shared<Scene>(*whole);
    without(*bare);
    Engine with_data(whole), without_data(bare);
    for (PingRequest off : {high(), low()}) {
      off.switches.*part = false;
      PingRequest on = off;
      on.switches.*part = true;
      change(on);
      EXPECT_TRUE(bytes_of(with_data.ping(off)) == bytes_of(without_data.ping(on)));
    }
  };
  const auto as_it_is = [](auto&) {};
  const auto receiver = [](auto&& set) {
    return [set](PingRequest& r) {
      auto model = std::make_shared<SonarModel>(*r.model);
      set(model->modes[0].receiver);
      r.model = std::move(model);
    };
  };
  same(
      &Switches::texture,
      [](Scene& s) {
        for (Material& m : s.materials) m.texture = {};
      },
      as_it_is);
  same(
      &Switches::volume, [](Scene& s) { s.water_column = {}; }, as_it_is);
  same(
      &Switches::interference, [](Scene& s) { s.other_sonars.clear(); }, as_it_is);
  same(&Switches::leak, as_it_is, receiver([](ReceiverLaw& law) { law.leak_upa = 0; }));
  same(&Switches::crosstalk, as_it_is, receiver([](ReceiverLaw& law) { law.crosstalk_db = -200; }));
}

TEST(Everything, AtRestMotionAndDopplerChangeNothing) {
  Engine engine(basin());
  for (const PingRequest& moving : {high(), low()}) {
    PingRequest rest = moving;
    rest.sonar_moves = {};
    PingRequest off = moving;
    off.switches.motion = off.switches.doppler = false;
    EXPECT_TRUE(bytes_of(engine.ping(off)) == bytes_of(engine.ping(rest)));
  }
}

}  // namespace
}  // namespace sonar::test
