// Compares the device engine with the CPU engine if both have the same rays (flat_ray_scene.cpp). The rest is arithmetic, which
// must be the same. The tests use all parts of the model, alone and together, in batches and ping by ping.
#include <gtest/gtest.h>

#include <chrono>

#include "tests/core/pipeline/basin.hpp"
#include "tests/core/pipeline/pulses.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/cuda/comparing.hpp"

namespace sonar::test {
namespace {

// The goal is 1e-4 and 1 LSB. With the same rays, on a processor that rounds like the device, there is no difference, except
// for the last bit of a library's sine, and where one engine uses a transform and the other a band across the beams.
constexpr double most_apart = 5e-6;

void expect_same(const Ping& cpu, const Ping& device, const std::string& what) {
  const Apart d = compare(cpu, device);
  EXPECT_TRUE(d.shape) << what;
  EXPECT_LE(d.relative_l2, most_apart) << what;
  EXPECT_LE(d.most_lsb, 1u) << what;
  EXPECT_LE(static_cast<double>(d.samples_off), 1e-3 * static_cast<double>(cpu.samples.size())) << what;
  EXPECT_TRUE(d.truth) << what;
}

/// Beams three times as wide need a ninth of the cells. Most of the time is spent on making cells.
std::shared_ptr<const SonarModel> with_wide_beams(FrequencyMode mode, Waveform::Shape shape) {
  mode.pattern.azimuth_width_rad *= 3;
  return model_of(mode, shape, false);
}

/// Returns all variants that the device computes, tones in the time domain included. Only two of them have ghosts, because the
/// CPU computes these slowly.
std::vector<std::pair<std::string, PingRequest>> on_device_turns() {
  auto all = turns();
  const auto tone = with_wide_beams(p900(), Waveform::Shape::cw), sweep = with_wide_beams(oculus_high(), Waveform::Shape::lfm);
  for (auto& [what, request] : all) {
    const auto& wide = request.model->modes[0].waveform.exact ? tone : sweep;
    if (what.starts_with("listed beams")) {
      SonarModel own = *wide;
      own.modes[0].beam_spacing = BeamSpacing::listed;
      own.modes[0].beam_azimuths_rad = request.model->modes[0].beam_azimuths_rad;
      for (const float width : request.model->modes[0].beam_widths_rad) own.modes[0].beam_widths_rad.push_back(3 * width);
      request.model = std::make_shared<const SonarModel>(std::move(own));
    } else {
      request.model = wide;
    }
    request.switches.multipath = what == "everything, high" || what == "everything, low";
  }
  std::erase_if(all, [](const auto& turn) {
    return !cuda::why_not_on_device(turn.second).empty() || turn.first.starts_with("everything again") ||
           turn.first.starts_with("everything at last");
  });
  return all;
}

TEST(DeviceEngine, ComputesEveryPartOfTheModelLikeTheCpu) {
  SKIP_WITHOUT_A_MACHINE();
  BothEngines both(basin());
  std::size_t compared = 0;
  for (const auto& [what, request] : on_device_turns()) {
    expect_same(both.by_cpu(request), both.by_device(request), what);
    ++compared;
  }
  EXPECT_GE(compared, 14u);
  EXPECT_TRUE(both.said.empty());
}

// Exact tones and a measured complex pulse: the engines put echoes on a grid, transform it twice, and take samples.
TEST(DeviceEngine, SumsPulsesInTheSpectrumAsTheCpuDoes) {
  SKIP_WITHOUT_A_MACHINE();
  if (const std::string why = spectral::have_transform ? test_machine().value()->why_no_transforms() : "no FFTW"; !why.empty())
    GTEST_SKIP() << why << ": the CPU computes exact pulses";
  SonarModel measured;
  measured.name = "measured";
  measured.modes = {p900()};
  measured.modes[0].waveform = waveform_of(Waveform::Shape::measured);
  measured.modes[0].pattern.azimuth_width_rad *= 3;
  const auto lopsided = std::make_shared<const SonarModel>(std::move(measured));
  FrequencyMode wide = p900();
  wide.pattern.azimuth_width_rad *= 3;
  const auto tone = model_of(wide, Waveform::Shape::cw, true);
  BothEngines both(basin());
  std::vector<PingRequest> requests;
  for (const char* turn : {"everything, low", "blank, low", "flat beams, low", "fewer beams and rows, low", "somewhere else, low",
                           "everything again, low", "expected power, low"})
    for (auto& [what, request] : turns()) {
      if (what != turn) continue;
      for (const auto& model : {tone, lopsided}) {
        PingRequest r = request;
        r.model = model;
        r.switches.multipath = what == "everything, low";
        if (model == lopsided) r.settings.samples_per_row = 1;
        SCOPED_TRACE(what + ", " + model->name);
        expect_same(both.by_cpu(r), both.by_device(r), what + ", " + model->name);
        requests.push_back(std::move(r));
      }
    }
  ASSERT_EQ(requests.size(), 14u);
  EXPECT_TRUE(both.said.empty()) << both.said[0];
  // A batch may also have pings that need no transform.
  requests.push_back(high());
  requests.back().switches.multipath = false;
  std::swap(requests.back(), requests[2]);
  std::vector<Ping> single;
  for (const PingRequest& r : requests) single.push_back(both.by_device(r));
  const std::vector<Ping> batched = both.by_device(requests);
  for (std::size_t i = 0; i < single.size(); ++i) EXPECT_EQ(batched[i].samples, single[i].samples) << i;
}

TEST(DeviceEngine, MakesTheSameBytesInBatchesOfOneAndThree) {
  SKIP_WITHOUT_A_MACHINE();
  std::vector<PingRequest> requests;
  for (auto& [what, request] : on_device_turns())
    if (!request.switches.expected_power && !request.switches.multipath && requests.size() < 7) requests.push_back(request);
  BothEngines one(basin(), SimdLevel::portable, 1), three(basin(), SimdLevel::portable, 3);
  std::vector<Ping> single;
  for (const PingRequest& r : requests) single.push_back(one.by_device(r));
  const std::vector<Ping> batched = three.by_device(requests);
  ASSERT_EQ(batched.size(), 7u);
  for (std::size_t i = 0; i < single.size(); ++i) {
    EXPECT_EQ(batched[i].samples, single[i].samples) << i;
    EXPECT_EQ(batched[i].pressure_upa, single[i].pressure_upa) << i;
    EXPECT_EQ(batched[i].request.number, requests[i].number) << i;
  }
}

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// A repeated launch may replay a captured graph; a timed launch never does. A batch may end because memory is full, and cells may
// be sent again.
TEST(DeviceEngine, MakesTheSameBytesForEveryKindOfLaunch) {
  SKIP_WITHOUT_A_MACHINE();
  PingRequest request;
  for (auto& [what, r] : on_device_turns())
    if (what == "somewhere else, high") request = r;
  ASSERT_TRUE(request.model);
  const std::vector<PingRequest> four(4, request);
  const auto scene = basin();
  Parallel pool(1);
  std::vector<cuda::DeviceEngineOptions> ways(4);
  ways[1].batch = 2;
  ways[2].work_bytes = ways[3].cell_bytes = 1;
  ways[3].batch = 1;
  std::vector<std::byte> samples;
  for (const auto& options : ways)
    for (double (*clock)() : {static_cast<double (*)()>(nullptr), seconds}) {
      const auto engine = cuda::make_device_engine(scene, pool, {.now_s = clock}, test_machine().value(), options);
      for (int again = 0; again < 4; ++again)
        for (const Ping& ping : engine->run(four)) {
          if (samples.empty()) samples = ping.samples;
          ASSERT_EQ(ping.samples, samples) << again;
        }
      const PingStatistics took = engine->statistics();
      for (const Stage s : {Stage::trace, Stage::scatter, Stage::synthesize, Stage::noise, Stage::form_beams, Stage::receive})
        EXPECT_EQ(took.seconds[static_cast<std::size_t>(s)] > 0, clock != nullptr) << stage_names[static_cast<std::size_t>(s)];
    }
}

TEST(DeviceEngine, UsesTheCpuForOtherPingsAndReportsThisOnce) {
  SKIP_WITHOUT_A_MACHINE();
  BothEngines both(basin());
  std::vector<PingRequest> requests{high(), high(), low(), low(), high()};
  for (PingRequest& r : requests) r.switches.multipath = false, r.settings.range_bin_count = 30;
  requests[1].switches.fixed_fan = 40;
  const bool transforms = test_machine().value()->why_no_transforms().empty();
  EXPECT_EQ(cuda::why_not_on_device(low()), "");
  EXPECT_EQ(cuda::why_not_on_device(low(), false), spectral::have_transform ? "pings with an exact pulse" : "");
  PingRequest labelled = high();
  labelled.switches.keep_labels = true;
  EXPECT_EQ(cuda::why_not_on_device(labelled), "pings with labels");
  const std::vector<Ping> pings = both.by_device(requests);
  for (std::size_t i = 0; i < requests.size(); ++i) expect_same(both.by_cpu(requests[i]), pings[i], std::to_string(i));
  ASSERT_EQ(both.said.size(), spectral::have_transform && !transforms ? 2u : 1u);
  EXPECT_EQ(both.said[0], "CUDA: pings of a fixed fan are computed by the CPU");
  requests[0].settings.beam_count = 0;
  EXPECT_THROW(both.by_device(requests), std::invalid_argument);
}

struct Case {
  std::string name;
  FrequencyMode mode;
  PingSettings settings;
};
std::vector<Case> cases() {
  PingSettings near = default_rows(2, 703);
  near.format = {.bits = 8, .max_code = 254, .gamma = 0.5f, .row_gains = false};
  return {{"P1", p900(), default_rows(10, 394)}, {"P3a", oculus_high(), default_rows(10, 437)}, {"P3c", oculus_high(), near}};
}

// Pings of the benchmark's sizes over a relief with objects, at rest and in motion. The device is also compared with the CPU's
// widest instructions.
TEST(DeviceEngine, ComputesPingsOfTheBenchmarkAsTheCpuDoes) {
  SKIP_WITHOUT_A_MACHINE();
  SceneMaker maker;
  maker.add(height_field(-1, 12, -10, 10, 0.1, rough_relief(0.1, 30)), -25, {0, 0, -2});
  maker.add(sphere(0.5, 4), -15, {5, 0.7, -1.5});
  maker.add_body(box({0.4, 0.3, 0.3}), -15, {{4, -1, -1.4}, quat_from_rpy({0.1, 0.2, 0.7})});
  // There are more objects than marks of 1 / x. The last object, closely in front of the sphere, has the same mark as the
  // sphere.
  for (int i = 3; i < 65; ++i) maker.add(wall(0.1, 0.1), -10, {-2.0 - i, 0, 0});
  maker.add(wall(0.3, 0.3), -20, {4.48, 0.7, -1.5});
  const auto scene = maker.make();
  for (const Case& c : cases()) {
    SonarModel model;
    model.name = "test";
    model.modes = {c.mode};
    PingRequest r;
    r.model = std::make_shared<const SonarModel>(std::move(model));
    r.settings = c.settings;
    r.settings.gain_db = 20;
    r.water = {.temperature_c = 10, .salinity_psu = 0, .ph = 8, .sound_speed_mps = 1480};
    r.sonar_in_world = {{0, 0, 0}, quat_from_rpy({0, 0.25, 0.1})};
    r.seed = Seed{3};
    r.switches.keep_pressure = r.switches.keep_beams = r.switches.keep_truth = true;
    BothEngines both(scene);
    const Ping cpu = both.by_cpu(r), device = both.by_device(r);
    expect_same(cpu, device, c.name);
    const PingStatistics ours = both.device().statistics(), theirs = both.cpu().statistics();
    EXPECT_EQ(ours.rays, theirs.rays) << c.name;
    EXPECT_EQ(ours.tiles, theirs.tiles) << c.name;
    EXPECT_EQ(ours.echoes, theirs.echoes) << c.name;
    RecordProperty(c.name, std::to_string(compare(cpu, device).relative_l2));

    // The CPU's wider instructions fuse multiplications with additions, which changes the phase of carriers by a
    // ten-thousandth. The device may differ from them as much as the CPU's own portable loops do.
    Parallel pool(2);
    const Ping fused = make_cpu_engine(scene, pool, {})->run({&r, 1}).at(0);
    EXPECT_LE(compare(fused, device).relative_l2, 1.01 * compare(fused, cpu).relative_l2 + 1e-6) << c.name;
    EXPECT_LE(compare(fused, device).relative_l2, 5e-4) << c.name;
    r.sonar_moves = {{0.8, 0.1, 0}, {0, 0.05, 0.3}};
    expect_same(both.by_cpu(r), both.by_device(r), c.name + " moving");
  }
}

// Side-lobe cells of different seeds differ only in their phases, and memory of dropped cells is reused.
TEST(DeviceEngine, UsesNoCellsOfAnotherSeed) {
  SKIP_WITHOUT_A_MACHINE();
  SceneMaker maker;
  maker.add(height_field(-1, 12, -10, 10, 0.5, [](double, double) { return 0.0; }), -25, {0, 0, -2});
  const Case c = cases().front();
  SonarModel model;
  model.name = "test";
  model.modes = {c.mode};
  PingRequest r;
  r.model = std::make_shared<const SonarModel>(std::move(model));
  r.settings = c.settings;
  r.settings.gain_db = 20;
  r.water = {.temperature_c = 10, .salinity_psu = 0, .ph = 8, .sound_speed_mps = 1480};
  r.sonar_in_world = {{0, 0, 0}, quat_from_rpy({0, 0.1, 0})};
  r.switches.side_lobes = true;
  BothEngines both(maker.make());
  std::vector<Ping> pings;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    r.seed = Seed{seed};
    pings.push_back(both.by_cpu(r));
    expect_same(pings.back(), both.by_device(r), "seed " + std::to_string(seed));
  }
  EXPECT_NE(pings[0].samples, pings[1].samples);
}

}  // namespace
}  // namespace sonar::test
