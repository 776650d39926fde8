// The comparison modes through the whole engine: oracles 9 and 46, levels, and determinism. Canonical pings must not change.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "core/paper/paper_engine.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

Vec3d at(double range_m, double azimuth_deg, double elevation_deg) {
  const double azimuth = rad_from_deg(azimuth_deg), elevation = rad_from_deg(elevation_deg);
  return {range_m * std::cos(elevation) * std::cos(azimuth), range_m * std::cos(elevation) * std::sin(azimuth),
          range_m * std::sin(elevation)};
}

/// An engine of all modes over one scene. Its request starts with the values of the pipeline's tests.
struct Comparison {
  Comparison(std::shared_ptr<const Scene> scene, const FrequencyMode& mode, const PingSettings& settings, int threads = 2,
             paper::FrequencySum sum = paper::FrequencySum::fast)
      : pool(threads), request(Sounding(scene, mode, settings).request), engine(make_engine(std::move(scene), pool, {}, sum)) {}

  Ping ping(Mode mode) {
    request.switches.mode = mode;
    return std::move(engine->run({&request, 1}).front());
  }
  Parallel pool;
  PingRequest request;
  std::unique_ptr<PingEngine> engine;
};

double at_row(const Ping& ping, int row, int beam) {
  const auto beams = ping.beam_azimuth_rad.size();
  return static_cast<double>(ping.pressure_upa[static_cast<std::size_t>(row) * beams + static_cast<std::size_t>(beam)]);
}
std::size_t loudest(const Ping& ping) {
  return static_cast<std::size_t>(std::max_element(ping.pressure_upa.begin(), ping.pressure_upa.end()) -
                                  ping.pressure_upa.begin());
}
/// Returns the azimuth of the sample with the highest level.
double loudest_azimuth_deg(const Ping& ping) {
  return deg_from_rad(static_cast<double>(ping.beam_azimuth_rad[loudest(ping) % ping.beam_azimuth_rad.size()]));
}

/// Returns settings with few rows and beams up to 4 m, which are fast.
PingSettings small_settings(int beams = 64) {
  PingSettings s = native_rows(4, 0.0254);
  s.beam_count = beams;
  s.range_bin_m = 4.0 / 120;
  s.range_bin_count = 120;
  s.pulse_width_m = 0.03f;
  return s;
}

// The record begins at the window. Echoes outside the window are omitted together with their side lobes.
TEST(PaperWindow, ShowsAPointInItsRow) {
  constexpr int skipped = 40;
  for (const Mode mode : {Mode::paper, Mode::raster}) {
    Comparison c(SceneMaker().add_point({3.01, 0, 0}, -10).add_point({1, 0, 0}, 20).make(), p900(), small_settings());
    c.request.settings.range_start_m = skipped * c.request.settings.range_bin_m;
    c.request.settings.range_bin_count -= skipped;
    const Ping window = c.ping(mode);
    const int row = static_cast<int>(loudest(window) / window.beam_azimuth_rad.size());
    EXPECT_EQ(row, static_cast<int>(3.01 / c.request.settings.range_bin_m) - skipped) << "the nearer, louder one is left out";
    Comparison whole(SceneMaker().add_point({3.01, 0, 0}, -10).make(), p900(), small_settings());
    EXPECT_NEAR(at_row(window, row, 32) / at_row(whole.ping(mode), row + skipped, 32), 1, 0.01) << "its tail is left out, too";
  }
}

TEST(PaperOracles, Oracle09_SphereInPaperMode) {
  // sum mu cos^2 r^2 dOmega over the disc of a distant sphere: (pi / 2) mu a^2. Lambert's own law gives (2 pi / 3) mu a^2.
  constexpr double radius = 0.1, distance = 100;
  FrequencyMode mode = p900();
  mode.horizontal_aperture_rad = static_cast<float>(2.4 * radius / distance);
  mode.pattern.elevation_width_rad = mode.horizontal_aperture_rad / 2;  // the fan is twice as high
  PingSettings settings = small_settings(130);
  settings.range_m = 110;
  settings.range_bin_m = 110.0 / settings.range_bin_count;
  const auto scene = SceneMaker().add(sphere(radius, 7), -10, {distance, 0, 0}).make();
  const PingRequest request = Sounding(scene, mode, settings).request;
  const PingPlan plan = make_plan(mode, settings, request.switches);
  const RayScene rays(scene, 1);
  const PingScalars scalars = make_scalars(plan, request, rays.origin());
  constexpr double mu = 0.1;
  for (const Mode which : {Mode::paper, Mode::raster}) {
    const paper::PaperFan fan = paper::make_paper_fan(plan, which, 130);
    std::vector<paper::PaperHit> hits;
    for (int column = 0; column < fan.columns(); ++column) paper::trace_column(rays, fan, scalars, column, 200, hits);
    double printed = 0, lambert = 0;
    for (const paper::PaperHit& hit : hits) {
      printed += paper::printed_cross_section_m2(mu, hit.cosine, hit.range_m, hit.solid_angle_sr);
      lambert += lambert_per_area(mu, hit.cosine) * footprint_area_m2(hit.cosine, hit.range_m, hit.solid_angle_sr);
    }
    const char* name = which == Mode::paper ? "paper" : "raster";
    record_oracle(9, std::string(name) + " mode: sum of eq. (2) over (pi / 2) mu a^2, far sphere, 108 rays across", 0,
                  10 * std::log10(printed / (pi / 2 * mu * radius * radius)), 0.05, "dB");
    EXPECT_NEAR(10 * std::log10(lambert / (2 * pi / 3 * mu * radius * radius)), 0, 0.05);
  }
}

TEST(PaperOracles, Oracle46_APointAppearsAtItsAzimuthUnlessBeamsAreCones) {
  const auto scene = SceneMaker().add_point(at(3, 45, -20), 0).make();
  FrequencyMode mode = p900();
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(100));     // the point must lie in the sector
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(45));  // and within the elevation width
  PingSettings settings = small_settings(512);
  Comparison c(scene, mode, settings);
  const double cone = deg_from_rad(std::asin(std::cos(rad_from_deg(20)) * std::sin(rad_from_deg(45))));
  EXPECT_NEAR(loudest_azimuth_deg(c.ping(Mode::canonical)), cone, 0.1);  // 41.6
  record_oracle(46, "paper mode: point at azimuth 45, elevation -20", 45, loudest_azimuth_deg(c.ping(Mode::paper)), 0.1, "deg");
  record_oracle(46, "raster mode: the same point", 45, loudest_azimuth_deg(c.ping(Mode::raster)), 0.1, "deg");
  c.request.switches.conical = false;
  record_oracle(46, "conical off: the same point", 45, loudest_azimuth_deg(c.ping(Mode::canonical)), 0.1, "deg");
}

TEST(PaperEngine, APointsLevelIsThePrintedOneOverTheCorrectionsNorm) {
  // For one beam the correction is 1. For two equal, distant beams it is 1 over the root of 2, times the rest of |sinc|.
  PingSettings settings = small_settings(1);
  const double range = (60 + settings.row_centre) * settings.range_bin_m;
  const auto scene = SceneMaker().add_point({range, 0, 0}, -12).make();
  Comparison c(scene, p900(), settings);
  const Sounding s(scene, p900(), settings);
  const double expected = 210 - 40 * std::log10(range) - 2 * 8.685889638 * s.medium().absorption_np_per_m * range - 12;
  EXPECT_NEAR(20 * std::log10(at_row(c.ping(Mode::paper), 60, 0)), expected, 0.01);
  c.request.switches.expected_power = true;
  EXPECT_NEAR(20 * std::log10(at_row(c.ping(Mode::paper), 60, 0)), expected, 0.01);
  EXPECT_NEAR(20 * std::log10(at_row(c.ping(Mode::raster), 60, 0)), expected, 0.01);
}

TEST(PaperEngine, MeanOfManyPingsIsTheExpectedPower) {
  const auto scene = SceneMaker().add(wall(3, 3), -10, {2, 0, 0}).make();
  Comparison c(scene, p900(), small_settings());
  c.request.switches.fixed_fan = 40;
  c.request.switches.expected_power = true;
  const Ping mean = c.ping(Mode::paper);
  c.request.switches.expected_power = false;
  constexpr int pings = 60;
  double sum = 0, expected = 0;
  for (int i = 0; i < pings; ++i) {
    c.request.number = PingNumber{static_cast<std::uint32_t>(i)};
    for (const float p : c.ping(Mode::paper).pressure_upa) sum += static_cast<double>(p) * static_cast<double>(p) / pings;
  }
  for (const float p : mean.pressure_upa) expected += static_cast<double>(p) * static_cast<double>(p);
  EXPECT_NEAR(10 * std::log10(sum / expected), 0, 0.3);
}

TEST(PaperEngine, ACanonicalPingIsTheCpuEnginesToTheByte) {
  const auto scene = SceneMaker().add(wall(3, 3), -10, {2, 0, 0}).make();
  Comparison c(scene, p900(), small_settings());
  Sounding s(scene, p900(), small_settings());
  c.ping(Mode::paper);
  EXPECT_EQ(c.ping(Mode::canonical).samples, s.ping().samples);
  std::vector<PingRequest> batch(4, c.request);
  batch[1].switches.mode = batch[2].switches.mode = Mode::raster;
  const std::vector<Ping> pings = c.engine->run(batch);
  ASSERT_EQ(pings.size(), 4u);
  EXPECT_EQ(pings[0].samples, s.last().samples);
  EXPECT_EQ(pings[3].samples, s.last().samples);
  EXPECT_EQ(pings[1].samples, pings[2].samples);
  EXPECT_NE(pings[1].samples, pings[0].samples);
  // Submits in two ways. The results of both kinds of calls come back in order.
  const std::span<const PingRequest> all(batch);
  for (const std::size_t first : {0u, 1u, 3u}) c.engine->submit(all.subspan(first, 1));
  c.engine->submit(all);
  for (const std::size_t which : {0u, 1u, 3u}) EXPECT_EQ(c.engine->collect().at(0).samples, pings[which].samples) << which;
  const std::vector<Ping> again = c.engine->collect();
  ASSERT_EQ(again.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(again[i].samples, pings[i].samples) << i;
  EXPECT_EQ(c.engine->statistics_of_each().size(), 4u);
}

TEST(PaperEngine, SumsAndThreadsDoNotMatter) {
  const auto scene = SceneMaker().add(wall(3, 3), -10, {2, 0, 0}).make();
  Comparison fast(scene, p900(), small_settings()), serial(scene, p900(), small_settings(), 1),
      direct(scene, p900(), small_settings(), 2, paper::FrequencySum::direct);
  for (const Mode mode : {Mode::paper, Mode::raster}) {
    const Ping a = fast.ping(mode), b = serial.ping(mode), c = direct.ping(mode);
    EXPECT_EQ(a.pressure_upa, b.pressure_upa);
    double off = 0, all = 0;
    for (std::size_t i = 0; i < a.pressure_upa.size(); ++i) {
      off += std::pow(static_cast<double>(a.pressure_upa[i] - c.pressure_upa[i]), 2);
      all += std::pow(static_cast<double>(c.pressure_upa[i]), 2);
    }
    EXPECT_GT(all, 0);
    EXPECT_LT(std::sqrt(off / all), 1e-4);
  }
}

TEST(PaperEngine, EchoesBeyondTheRecordAreDroppedAndABlankPingIsSilent) {
  Comparison c(SceneMaker().add(wall(9, 9), -10, {5, 0, 0}).make(), p900(), small_settings());
  for (const float p : c.ping(Mode::paper).pressure_upa) ASSERT_EQ(p, 0);
  Comparison near(SceneMaker().add(wall(9, 9), -10, {2, 0, 0}).make(), p900(), small_settings());
  near.request.blank = true;
  for (const float p : near.ping(Mode::paper).pressure_upa) ASSERT_EQ(p, 0);
  near.request.settings.beam_count = 0;
  EXPECT_THROW(near.ping(Mode::paper), std::invalid_argument);
}

TEST(PaperEngine, HasMovingBodiesAndTruth) {
  SceneMaker maker;
  maker.add_body(box({0.1, 2, 2}), -10, {{1.6, 0, 0}, {}});
  Comparison c(maker.make(), p900(), small_settings());
  c.request.switches.keep_truth = true;
  c.request.bodies_in_world = {{{2.6, 0, 0}, {}}};
  const Ping ping = c.ping(Mode::paper);
  ASSERT_EQ(ping.truth.size(), 64u);
  EXPECT_EQ(ping.truth[32].object, 0u);
  EXPECT_NEAR(ping.truth[32].range_m, 2.5, 0.01);
  const double row = static_cast<double>(loudest(ping) / 64);
  EXPECT_NEAR((row + 0.5) * c.request.settings.range_bin_m, 2.55, 0.1);
}

}  // namespace
}  // namespace sonar::test
