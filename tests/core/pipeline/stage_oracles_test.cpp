// Oracles on single stages: column synthesis and beamforming compared with direct sums in double, quantisation, and inputs that
// must not break a ping.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/pipeline/synthesize.hpp"
#include "tests/core/pipeline/kernel_sets.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

PingPlan plan_of(const FrequencyMode& mode, const PingSettings& settings) { return make_plan(mode, settings, Switches{}); }

TEST(StageOracles, Oracle18_SynthesisAgainstDirectSum) {
  for (const PingSettings& settings : {native_rows(8, 0.0254), default_rows(8, 300)}) {
    const PingPlan plan = plan_of(p900(), settings);
    reference::Grid grid{1500, plan.envelope_hz, 0.5 * plan.sample_spacing_m, plan.sample_spacing_m, plan.samples};
    std::mt19937 random(11);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    const double margin = 4 / plan.envelope_hz * 750, span = 8 - 2 * margin;
    std::vector<reference::Scatterer> scatterers;
    for (int i = 0; i < 300; ++i) scatterers.push_back({margin + span * uniform(), 0, std::polar(uniform(), 2 * pi * uniform())});
    const auto truth = reference::signal_in_time(scatterers, grid);
    for (const simd::Kernels* kernels : kernel_sets()) {
      Echoes echoes;
      for (const auto& s : scatterers) {
        echoes.add(static_cast<float>(s.range_m / plan.sample_spacing_m - 0.5), std::complex<float>(s.amplitude), 2);
      }
      ColumnSignals columns;
      columns.shape(5, plan.samples, plan.taps);
      clear_columns(columns, 0, 5);
      synthesize(echoes, plan.pulse(), *kernels, columns);
      double error = 0, power = 0;
      for (int n = 0; n < plan.samples; ++n) {
        const float* at = columns.first_sample(2) + 2 * n;
        const std::complex<double> got(static_cast<double>(at[0]), static_cast<double>(at[1]));
        error += std::norm(got - truth[static_cast<std::size_t>(n)]), power += std::norm(truth[static_cast<std::size_t>(n)]);
        EXPECT_EQ(columns.first_sample(1)[2 * n], 0.0f);
      }
      record_below(18, "error of 300 echoes, Gaussian pulse", 1e-4, std::sqrt(error / power), "");
    }
  }
}

TEST(StageOracles, PulseThatBeginsBeforeOrEndsAfterTheRecordIsCutNotWrapped) {
  const PingPlan plan = plan_of(p900(), default_rows(8, 300));
  for (const simd::Kernels* kernels : kernel_sets()) {
    Echoes echoes;
    echoes.add(-0.75f, {1, 0}, 0);
    echoes.add(static_cast<float>(plan.samples) - 0.25f, {0, 1}, 0);
    ColumnSignals columns;
    columns.shape(1, plan.samples, plan.taps);
    clear_columns(columns, 0, 1);
    synthesize(echoes, plan.pulse(), *kernels, columns);
    const double per_sample = plan.envelope_hz * 2 * plan.sample_spacing_m / 1500;
    const float* at = columns.first_sample(0);
    EXPECT_NEAR(static_cast<double>(at[0]), envelope(1, 0.75 * per_sample), 1e-5);
    EXPECT_NEAR(static_cast<double>(at[2 * (plan.samples - 1) + 1]), envelope(1, 0.75 * per_sample), 1e-5);
    for (int n = 10; n < plan.samples - 10; ++n) ASSERT_EQ(at[2 * n], 0.0f);
  }
}

struct BeamWeightsCase {
  FrequencyMode mode;
  int beams;
};

/// Compares random columns in this stage, in the dense sum and in the banded sum.
void check_beam_weights(const BeamWeightsCase& c, const simd::Kernels& kernels) {
  PingSettings settings = default_rows(8, 40);
  settings.beam_count = c.beams;
  const PingPlan plan = plan_of(c.mode, settings);
  ColumnSignals columns;
  columns.shape(plan.columns.count, plan.samples, plan.taps);
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  clear_columns(columns, 0, plan.columns.count);
  for (int k = 0; k < plan.columns.count; ++k) {
    for (int i = 0; i < 2 * plan.samples; ++i) columns.column(k)[2 * columns.lead + i] = normal(random);
  }
  BeamScratch scratch;
  BeamSignals beams;
  beams.shape(c.beams, 8, 16);
  form_beams(columns, plan.beam_weights, kernels, scratch, beams);

  const double aperture =
      aperture_in_wavelengths(c.mode.pattern.azimuth_taper, static_cast<double>(c.mode.pattern.azimuth_width_rad));
  double error = 0, power = 0, dropped = 0, all = 0;
  for (int j = 0; j < c.beams; ++j) {
    const double beam_sine = plan.beam_sine[static_cast<std::size_t>(j)];
    const double centre = (plan.columns.first_sine - beam_sine) / plan.columns.spacing;
    double dense[32] = {};
    for (int k = 0; k < plan.columns.count; ++k) {
      const double w = directivity(c.mode.pattern.azimuth_taper, aperture, plan.columns.sine(k) - beam_sine);
      for (int i = 0; i < 32; ++i) dense[i] += w * static_cast<double>(columns.first_sample(k)[16 + i]);
      all += w * w, dropped += std::abs(k - centre) <= plan.beam_weights.half_band ? 0 : w * w;
    }
    for (int i = 0; i < 32; ++i) {
      const double off = static_cast<double>(beams.beam(j)[i]) - dense[i];
      error += off * off, power += dense[i] * dense[i];
    }
  }
  // A panel of four beams uses the union of their bands. Therefore its error may be smaller than that of one band, but not
  // larger.
  const bool whole = dropped == 0;
  record_below(19, whole ? "nothing dropped: error" : "band: error over 1.1 of what was dropped + 1e-5", whole ? 1e-5 : 1,
               std::sqrt(error / power) / (whole ? 1 : 1.1 * std::sqrt(dropped / all) + 1e-5), "");
  EXPECT_LE(dropped / all, 1e-4) << "the band drops more than -40 dB";
}

TEST(StageOracles, Oracle19_BeamsAgainstDenseSum) {
  FrequencyMode narrow = p900();
  narrow.beam_spacing = BeamSpacing::uniform_in_sine;
  FrequencyMode open = oculus_low();  // no energy is dropped: the sum itself must be accurate to a float
  open.pattern.azimuth_taper = Taper::unit;
  for (const simd::Kernels* kernels : kernel_sets()) {
    for (const BeamWeightsCase& c :
         {BeamWeightsCase{p900(), 512}, BeamWeightsCase{narrow, 256}, BeamWeightsCase{oculus_high(), 512},
          BeamWeightsCase{oculus_low(), 256}, BeamWeightsCase{oculus_low(), 511}, BeamWeightsCase{p900(), 3},
          BeamWeightsCase{open, 256}}) {
      check_beam_weights(c, *kernels);
    }
  }
}

// End to end: points at random positions, compared with the double sum in which each has its exact sine.
TEST(StageOracles, PointsThroughTheEngineAgainstDirectSum) {
  for (const FrequencyMode& mode : {p900(), oculus_high()}) {
    std::mt19937 random(3);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    SceneMaker maker;
    std::vector<Vec3d> places;
    for (int i = 0; i < 40; ++i) {
      const double r = 1 + 4 * uniform(), azimuth = 0.8 * (uniform() - 0.5), elevation = 0.1 * (uniform() - 0.5);
      places.push_back(
          {r * std::cos(elevation) * std::cos(azimuth), r * std::cos(elevation) * std::sin(azimuth), r * std::sin(elevation)});
      maker.add_point(places.back(), -20);
    }
    PingSettings settings = native_rows(5.5, 0.0254);
    settings.beam_count = 64;
    Sounding s(maker.make(), mode, settings);
    s.ping();
    std::vector<reference::Scatterer> scatterers;
    for (const Vec3d& p : places) scatterers.push_back(reference::scatterer_at(mode, s.medium(), p, power_from_db(-20), 1));
    std::vector<double> sines;
    for (int j = 0; j < s.beams(); ++j) sines.push_back(s.beam_sine(j));
    const reference::Grid grid{1500, s.envelope_hz(), s.range_of_row(0), settings.range_bin_m, s.rows()};
    const auto truth = reference::beams(scatterers, sines, mode.pattern, grid);
    double error = 0, power = 0;
    for (int j = 0; j < s.beams(); ++j) {
      for (int n = 0; n < s.rows(); ++n) {
        const double t = std::abs(truth[static_cast<std::size_t>(j)][static_cast<std::size_t>(n)]), got = s.pressure(n, j);
        error += (got - t) * (got - t), power += t * t;
      }
    }
    EXPECT_LE(std::sqrt(error / power), 1e-4) << mode.name;
  }
}

std::uint32_t code_at(const Ping& ping, std::size_t i) {
  const int bytes = ping.request.settings.format.bits / 8;
  std::uint32_t code = 0;
  for (int b = bytes - 1; b >= 0; --b) {
    code = code << 8 |
           std::to_integer<std::uint32_t>(ping.samples[i * static_cast<std::size_t>(bytes) + static_cast<std::size_t>(b)]);
  }
  return code;
}

TEST(StageOracles, Oracle41_SamplesUndoTheirRowGain) {
  const auto scene = SceneMaker().add(height_field(-2, 40, -40, 40, 2, [](double, double) { return 0.0; }), -20).make();
  for (const SampleFormat& format : {SampleFormat{8, 255, 1, true}, SampleFormat{8, 254, 1, false},
                                     SampleFormat{16, 65535, 1, true}, SampleFormat{16, 65535, 1, false}}) {
    FrequencyMode mode = p900();
    mode.receiver.full_scale_upa = 3e7f;
    PingSettings settings = default_rows(10, 400);
    settings.format = format;
    settings.device_absorption_db_per_m = 0.25f;
    Sounding s(scene, mode, settings);
    const Ping& ping = s.ping_from({0, 0, 2}, {0, 0.25, 0});
    ASSERT_EQ(ping.row_gain.size(), format.row_gains ? 400u : 0u);
    const double smallest_db = tvg_db(mode.receiver, s.range_of_row(0), 0.25);
    std::size_t unsaturated = 0;
    double worst = 0;
    for (int row = 0; row < s.rows(); ++row) {
      const double row_db = tvg_db(mode.receiver, s.range_of_row(row), 0.25);
      const double gain = format.row_gains ? ping.row_gain[static_cast<std::size_t>(row)] : 1;
      EXPECT_GE(gain, 1);
      const double scale = full_scale_factor(mode.receiver, format.row_gains ? smallest_db : row_db) * format.max_code;
      for (int j = 0; j < s.beams(); ++j) {
        const std::uint32_t code = code_at(ping, static_cast<std::size_t>(row) * 512 + static_cast<std::size_t>(j));
        ASSERT_LE(code, format.max_code);
        if (code == format.max_code) continue;
        ++unsaturated;
        const double off = std::abs(code / std::sqrt(gain) - s.pressure(row, j) * scale);
        worst = std::max(worst, off / (0.5 / std::sqrt(gain) + 0.5));
      }
    }
    EXPECT_GT(unsaturated, 150000u);
    record_oracle(41, "samples undone, error over 0.5/sqrt(gain) + 0.5 LSB", 0, worst, 1, "");
  }
}

TEST(StageOracles, GammaAnd32BitsAreCoded) {
  const auto scene = SceneMaker().add(height_field(-2, 40, -40, 40, 2, [](double, double) { return 0.0; }), -20).make();
  for (const SampleFormat& format :
       {SampleFormat{8, 254, 0.5f, false}, SampleFormat{16, 65535, 0.7f, false}, SampleFormat{32, 4294967295u, 1, false}}) {
    FrequencyMode mode = p900();
    mode.receiver.full_scale_upa = 1e8f;
    PingSettings settings = default_rows(10, 400);
    settings.format = format;
    Sounding s(scene, mode, settings);
    const Ping& ping = s.ping_from({0, 0, 2}, {0, 0.25, 0});
    for (int row = 0; row < s.rows(); row += 7) {
      const double factor = full_scale_factor(mode.receiver, tvg_db(mode.receiver, s.range_of_row(row), 0));
      for (int j = 0; j < s.beams(); ++j) {
        const double expected = quantise(s.pressure(row, j) * factor, format);
        const double got = code_at(ping, static_cast<std::size_t>(row) * 512 + static_cast<std::size_t>(j));
        ASSERT_NEAR(got, expected, 1 + 2e-6 * expected) << row << " " << j;  // 32 bits: the tolerance is that of a float
      }
    }
  }
}

void expect_finite(const Ping& ping) {
  double bad = 0;
  for (const float p : ping.pressure_upa) bad += !(std::isfinite(p) && p >= 0);
  record_oracle(44, "samples that are not finite, awkward places", 0, bad, 0, "");
}

TEST(StageOracles, Oracle44_AwkwardPlacesStayFinite) {
  SceneMaker maker;
  maker.add(height_field(-3, 20, -10, 10, 1, [](double, double) { return 0.0; }), -20);
  maker.add(box({0.5, 0.5, 0.5}), -10, {3, 0, 0.5}).add(sphere(0.3, 2), -5, {1.5, 1, 0.3});
  maker.add_point({0, 0, 1}, 0).add_point({0, 0, 0}, 0).add_point({3, 0, 0.5}, 0);
  const auto scene = maker.make();
  const struct {
    Vec3d position;
    RollPitchYaw attitude;
  } places[] = {
      {{0, 0, 1}, {}},                  // at a point target: range zero
      {{0, 0, 0}, {}},                  // in the plane of the bed (grazing everywhere) and at another point
      {{0, 0, 1e-7}, {}},               // slightly above
      {{3, 0, 0.5}, {}},                // inside the box, at a point
      {{2.5, 0, 0.5}, {}},              // at the box's face
      {{1.5, 1, 0.6}, {0, pi / 2, 0}},  // at the sphere's top, looking down
      {{0, 0, 2}, {0, -pi / 2, 0}},     // looks straight up; nothing is there
      {{0, 0, 2}, {0, pi / 2, 0}},      // looks straight down
      {{1e6, -1e6, -500}, {1, 1, 1}},   // far from all objects
      {{-2.9, 0, 0.01}, {0, 0, pi}},    // at the edge, looking outward
  };
  for (const FrequencyMode& mode : {p900(), oculus_high()}) {
    Sounding s(scene, mode, default_rows(10, 394));
    for (const auto& place : places) {
      for (const bool expected_power : {false, true}) {
        for (const int fan : {0, 32}) {
          s.request.switches.expected_power = expected_power;
          s.request.switches.fixed_fan = fan;
          expect_finite(s.ping_from(place.position, place.attitude));
        }
      }
    }
  }
}

TEST(StageOracles, Oracle44_AwkwardHitsGiveFiniteEchoes) {
  const auto scene = SceneMaker().add(wall(5, 5), -20, {5, 0, 0}).make();
  Parallel pool;
  const RayScene rays(scene, 1);
  SurfaceCells cells(scene, Seed{1}, 1 << 20);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  std::vector<FanHit> hits;
  for (const float range : {5.0f, 0.0f, 1e-30f, -1.0f, nan, inf, -inf})
    for (const float cosine : {1.0f, 0.0f, 1e-30f, nan, inf})
      hits.push_back(
          {.column = 40, .ray = 3, .range_m = range, .elevation_rad = 0.1f, .cosine = cosine, .object = 0, .triangle = 0});
  double sound = 0, bad = 0;
  for (const bool expected_power : {false, true}) {
    for (const bool conical : {false, true}) {
      PingRequest request = Sounding(scene, p900(), default_rows(10, 394)).request;
      request.switches.expected_power = expected_power;
      request.switches.conical = conical;
      request.switches.fixed_fan = 32;
      const PingPlan plan = make_plan(p900(), request.settings, request.switches);
      Echoes echoes;
      const PingScalars scalars = make_scalars(plan, request, {});
      const std::vector<LawTable> laws = laws_of(*scene, plan, scalars);
      scatter_hits({rays, cells, {}, laws, {}, plan, scalars, simd::kernels_for(SimdLevel::automatic), pool}, hits, Seed{1},
                   echoes);
      for (int i = 0; i < echoes.count; ++i) {
        const auto at = static_cast<std::size_t>(i);
        bad += !(std::isfinite(echoes.sample[at]) && std::isfinite(echoes.re[at]) && std::isfinite(echoes.im[at]));
        sound += echoes.re[at] != 0;
      }
    }
  }
  EXPECT_GE(sound, 4) << "the only valid hit has an echo in every case";
  record_oracle(44, "echoes that are not finite, of NaN, infinite, zero-range and grazing hits", 0, bad, 0, "");
}

TEST(StageOracles, Oracle44_AwkwardSettingsAreRefused) {
  Sounding s(SceneMaker().make(), p900(), default_rows(10, 394));
  EXPECT_EQ(why_invalid(s.request), "");
  const auto refused = [&](auto&& change) {
    PingRequest r = s.request;
    change(r);
    EXPECT_NE(why_invalid(r), "");
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refused([&](PingRequest& r) { r.sonar_in_world.position_m.x = std::numeric_limits<double>::quiet_NaN(); });
  refused([&](PingRequest& r) { r.sonar_in_world.orientation.w = std::numeric_limits<double>::infinity(); });
  refused([&](PingRequest& r) { r.settings.range_m = nan; });
  refused([&](PingRequest& r) { r.settings.pulse_width_m = 0; });
  refused([&](PingRequest& r) { r.settings.range_bin_m = std::numeric_limits<double>::infinity(); });
  refused([&](PingRequest& r) { r.settings.device_sound_speed_mps = -1; });
  refused([&](PingRequest& r) { r.settings.gain_db = nan; });
  refused([&](PingRequest& r) { r.settings.beam_count = 0; });
  refused([&](PingRequest& r) { r.settings.mode = 1; });
  refused([&](PingRequest& r) { r.settings.format.gamma = nan; });
  refused([&](PingRequest& r) { r.settings.format.bits = 12; });
  refused([&](PingRequest& r) { r.model = nullptr; });
  refused([&](PingRequest& r) { r.sonar_moves.velocity_mps.y = std::numeric_limits<double>::quiet_NaN(); });
  refused([&](PingRequest& r) { r.sonar_moves.angular_rate_radps.z = std::numeric_limits<double>::infinity(); });
  refused([&](PingRequest& r) { r.sonar_moves.velocity_mps.x = 1e6; });
  refused([&](PingRequest& r) { r.bodies_in_world = {{}, {{0, std::numeric_limits<double>::quiet_NaN(), 0}, {}}}; });
  refused([&](PingRequest& r) { r.settings.format.max_code = 0; });
  refused([&](PingRequest& r) { r.settings.format.bits = 8; });  // with max_code 65535
  refused([&](PingRequest& r) { r.switches.fixed_fan = -1; });
  refused([&](PingRequest& r) { r.switches.fixed_fan = std::numeric_limits<int>::max(); });
}

// Requests for more memory than any machine has are also refused. Requests that are only large are accepted.
TEST(StageOracles, Oracle44_PicturesBeyondAllMemoryAreRefused) {
  Sounding s(SceneMaker().make(), p900(), default_rows(10, 394));
  const auto why = [&](auto&& change, bool exact = false) {
    PingRequest r = s.request;
    if (exact) {
      auto model = std::make_shared<SonarModel>(*r.model);
      model->modes[0].waveform.exact = true;
      r.model = std::move(model);
    }
    change(r.settings);
    return why_invalid(r);
  };
  const auto huge = [](PingSettings& p) { p.beam_count = 2048, p.range_bin_count = 65535, p.samples_per_row = 64; };
  const auto long_pulse = [](PingSettings& p) { p.pulse_width_m = 100, p.range_bin_m = 1e-4; };
  const auto short_pulse = [](PingSettings& p) { p.pulse_width_m = 1e-5f, p.range_bin_m = 0.1; };
  const auto large = [](PingSettings& p) { p.beam_count = 512, p.range_bin_count = 720, p.samples_per_row = 32; };
  const auto long_record = [](PingSettings& p) { p.range_bin_count = 65535; };
  EXPECT_NE(why(huge), "");
  EXPECT_NE(why(long_pulse), "");
  EXPECT_NE(why(short_pulse, true), "");
  EXPECT_EQ(why(short_pulse), "");
  EXPECT_EQ(why(large), "");
  EXPECT_EQ(why(long_record), "");
  EXPECT_EQ(why(long_record, true), "");
}

// A ping is a pure function of its request. Earlier pings must have no effect on it.
TEST(StageOracles, PingsDoNotDependOnEarlierPings) {
  SceneMaker maker;
  maker.add(height_field(-2, 14, -10, 10, 1, [](double, double) { return 0.0; }), -20);
  maker.add_body(box({0.3, 0.3, 0.5}), -5, {{4, 0, 0.5}, {}});
  const auto scene = maker.make();
  const auto fresh = [&](auto&& change) {
    Sounding s(scene, p900(), default_rows(10, 394));
    change(s.request);
    return s.ping_from({0, 0, 2}, {0, 0.25, 0}).pressure_upa;
  };
  Sounding used(scene, p900(), default_rows(10, 394));
  const auto same_as_fresh = [&](const char* what, auto&& change) {
    const PingRequest kept = used.request;
    change(used.request);
    EXPECT_EQ(used.ping_from({0, 0, 2}, {0, 0.25, 0}).pressure_upa, fresh(change)) << what;
    used.request = kept;
  };
  same_as_fresh("first", [](PingRequest&) {});
  same_as_fresh("moved body", [](PingRequest& r) { r.bodies_in_world = {{{6, 1, 0.5}, {}}}; });
  same_as_fresh("bodies back where the scene put them", [](PingRequest&) {});
  same_as_fresh("another model with a mode of the same name", [](PingRequest& r) {
    auto other = std::make_shared<SonarModel>(*r.model);
    other->modes[0].pattern.azimuth_width_rad *= 2;
    r.model = other;
  });
  same_as_fresh("source level of another product", [](PingRequest& r) {
    auto other = std::make_shared<SonarModel>(*r.model);
    other->modes[0].source_level_db -= 20;
    r.model = other;
  });
  same_as_fresh("another seed", [](PingRequest& r) { r.seed = Seed{5}; });
  same_as_fresh("expected power", [](PingRequest& r) { r.switches.expected_power = true; });
  same_as_fresh("fixed fan", [](PingRequest& r) { r.switches.fixed_fan = 50; });
  same_as_fresh("noise", [](PingRequest& r) { r.switches.noise = true; });
  same_as_fresh("blank", [](PingRequest& r) { r.blank = true; });
  same_as_fresh("colder water", [](PingRequest& r) { r.water.sound_speed_mps = 1430; });
  same_as_fresh("fewer beams", [](PingRequest& r) { r.settings.beam_count = 256; });
  same_as_fresh("last", [](PingRequest&) {});
}

}  // namespace
}  // namespace sonar::test
