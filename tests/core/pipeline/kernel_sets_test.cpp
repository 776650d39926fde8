// The hot loops with every instruction set: all give the same picture. Simple loops also give the picture of their definition.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/pipeline/trace_fan.hpp"
#include "tests/core/held_variable.hpp"
#include "tests/core/pipeline/kernel_sets.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

// The results agree within the rounding of a float.
TEST(KernelSets, AgreeOnAPing) {
  SceneMaker maker;
  maker.add(height_field(-2, 14, -10, 10, 0.1, rough_relief(0.03, 40)), -20).add(sphere(0.4, 3), -10, {5, 1, 0.4});
  const auto scene = maker.make();
  struct Case {
    bool expected_power, conical;
    int fixed_fan, bits;
  };
  for (const Case c : {Case{false, true, 0, 16}, Case{true, true, 0, 16}, Case{false, false, 0, 8}, Case{true, false, 0, 8},
                       Case{false, true, 60, 8}, Case{true, false, 60, 16}}) {
    std::vector<float> first;
    std::vector<std::byte> first_bytes;
    for (const SimdLevel level : {SimdLevel::portable, SimdLevel::avx2, SimdLevel::avx512}) {
      Sounding s(scene, oculus_high(), default_rows(10, 720), {.threads = 2, .engine = {.simd = level}});
      s.request.switches.expected_power = c.expected_power;
      s.request.switches.conical = c.conical;
      s.request.switches.fixed_fan = c.fixed_fan;
      s.request.settings.format.bits = c.bits;
      s.request.settings.format.max_code = c.bits == 8 ? 255 : 65535;
      s.request.settings.format.gamma = 0.5f;
      s.request.settings.gain_db = 10;
      const Ping& ping = s.ping_from({0, 0, 2}, {0, 0.25, 0});
      const std::vector<float> now = ping.pressure_upa;
      if (first.empty()) first = now, first_bytes = ping.samples;
      if (c.bits == 8) {
        int other = 0, far_off = 0, lit = 0;
        for (std::size_t i = 0; i < first_bytes.size(); ++i) {
          const int off = std::abs(static_cast<int>(first_bytes[i]) - static_cast<int>(ping.samples[i]));
          other += off > 0, far_off += off > 2, lit += first_bytes[i] != std::byte{0} && first_bytes[i] != std::byte{255};
        }
        EXPECT_GT(lit, 1000) << "the test needs codes that are neither 0 nor saturated";
        EXPECT_LE(other, static_cast<int>(first_bytes.size()) / 100) << s.engine().description();
        EXPECT_LE(far_off, static_cast<int>(first_bytes.size()) / 10000) << s.engine().description();
      }
      double error = 0, power = 0;
      for (std::size_t i = 0; i < now.size(); ++i) {
        error += std::pow(static_cast<double>(now[i]) - static_cast<double>(first[i]), 2);
        power += std::pow(static_cast<double>(first[i]), 2);
      }
      EXPECT_LE(std::sqrt(error / power), 1e-3) << s.engine().description();
    }
  }
}

// A ray of the fixed fan: an echo of sqrt(sigma) e^{-2 alpha r} / r^2 D(psi) with its own draw and carrier.
TEST(KernelSets, HitsOfTheFixedFanScatterAsDefined) {
  Material smooth;
  smooth.lambert_db = -15;
  smooth.roughness_m = 1e-4f;
  const auto scene = SceneMaker().add(wall(5, 5), -20, {5, 0, 0}).add_of(wall(5, 5), smooth, {7, 0, 0}).make();
  Parallel pool;
  const RayScene rays(scene, 1);
  SurfaceCells cells(scene, Seed{77}, 1 << 20);
  for (const bool conical : {false, true}) {
    PingRequest request = Sounding(scene, p900(), default_rows(10, 394)).request;
    request.switches.conical = conical;
    request.switches.specular = true;
    request.switches.fixed_fan = 500;
    const PingPlan plan = make_plan(p900(), request.settings, request.switches);
    const PingScalars scalars = make_scalars(plan, request, {});
    const double step = 2 * plan.fan.half_angle_rad / plan.fixed_fan;
    std::vector<FanHit> hits;
    for (int i = 0; i < 500; ++i) {
      const auto elevation = static_cast<float>((i + 0.5) * step - plan.fan.half_angle_rad);
      hits.push_back({.column = 20 + i,
                      .ray = i,
                      .range_m = 0.5f + 0.019f * static_cast<float>(i),
                      .elevation_rad = elevation,
                      .cosine = static_cast<float>(i % 100) / 99,
                      .object = static_cast<std::uint32_t>(i % 2),
                      .triangle = 0});
    }
    const std::vector<LawTable> laws = laws_of(*scene, plan, scalars);
    ASSERT_EQ(laws[1].root.empty(), false) << "one of the two materials has a law that is tabulated";
    for (const simd::Kernels* kernels : kernel_sets()) {
      Echoes echoes;
      scatter_hits({rays, cells, {}, laws, {}, plan, scalars, *kernels, pool}, hits, Seed{77}, echoes);
      ASSERT_EQ(echoes.count, 500);
      double off = 0, all = 0;
      for (std::size_t i = 0; i < hits.size(); ++i) {
        const FanHit& hit = hits[i];
        const double r = static_cast<double>(hit.range_m), cosine = static_cast<double>(hit.cosine);
        const double psi = static_cast<double>(hit.elevation_rad), sine = plan.columns.sine(hit.column);
        const double solid = plan.columns.spacing * step * (conical ? 1 : std::cos(psi) / std::sqrt(1 - sine * sine));
        const Material& material = scene->materials[scene->objects[hit.object].mesh->material[0]];
        const double sigma =
            scattering_strength(material, cosine, static_cast<double>(plan.mode.centre_hz), scalars.sound_speed_mps, true) *
            footprint_area_m2(cosine, r, solid);
        const double amplitude = scalars.source_upa * std::sqrt(sigma) * two_way_transmission(r, scalars.absorption_np_per_m) *
                                 elevation_two_way(plan.mode.pattern, psi);
        const Random4 draw =
            philox(hit.object, static_cast<std::uint32_t>(hit.column), static_cast<std::uint32_t>(hit.ray), 0x66616e, 77, 0);
        const ComplexNormal xi = complex_normal(draw.v[0], draw.v[1]);
        const std::complex<double> expected =
            std::complex<double>(xi.re, xi.im) * std::polar(amplitude, -2 * pi * r * scalars.turns_per_m);
        off += std::norm(expected - std::complex<double>(echoes.re[i], echoes.im[i]));
        all += std::norm(expected);
        EXPECT_NEAR(echoes.sample[i], scalars.sample_of(r), 1e-4);
        EXPECT_EQ(echoes.column[i], hit.column);
      }
      EXPECT_LT(std::sqrt(off / all), 1e-3) << kernels->name << ": the tabulated law is the coarsest part";
    }
  }
}

// The last packet of a column may contain one ray or all but one. The tracer may process 4, 8 or 16 rays together.
TEST(KernelSets, AFixedFanOfAnyNumberOfRaysIsTraced) {
  SceneMaker maker;
  maker.add(height_field(-2, 14, -10, 10, 0.5, rough_relief(0.03, 40)), -20);
  const auto scene = maker.make();
  for (int rays = 1; rays <= 18; ++rays) {
    std::vector<float> first;
    for (const char* isa : {"sse2", "avx2", ""}) {
      const tests::HeldVariable held("SONARD_EMBREE_ISA", isa);
      Sounding s(scene, oculus_high(), default_rows(10, 200), {.threads = 1, .engine = {}});
      s.request.switches.fixed_fan = rays;
      const std::vector<float> now = s.ping_from({0, 0, 2}, {0, 0.25, 0}).pressure_upa;
      if (first.empty()) first = now;
      double error = 0, power = 0;
      for (std::size_t i = 0; i < now.size(); ++i) {
        error += std::pow(static_cast<double>(now[i]) - static_cast<double>(first[i]), 2);
        power += std::pow(static_cast<double>(first[i]), 2);
      }
      ASSERT_GT(power, 0) << rays << " rays, " << isa;
      EXPECT_LT(error, 1e-4 * power) << rays << " rays, " << isa;
    }
  }
}

// A packet holds rays of several columns. The hits of a column do not depend on the columns that are traced with it.
TEST(KernelSets, HitsOfTheFixedFanDoNotDependOnTheColumnsTracedTogether) {
  SceneMaker maker;
  maker.add(height_field(-2, 14, -10, 10, 0.1, rough_relief(0.03, 40)), -20).add(sphere(0.4, 3), -10, {5, 1, 0.4});
  const auto scene = maker.make();
  PingRequest request = Sounding(scene, p900(), default_rows(10, 394)).request;
  request.switches.fixed_fan = 37;
  request.sonar_in_world = {{0, 0, 2}, quat_from_rpy({0, 0.25, 0})};
  const PingPlan plan = make_plan(p900(), request.settings, request.switches);
  const auto fields = [](const FanHit& h) {
    return std::tuple(h.column, h.ray, h.range_m, h.elevation_rad, h.cosine, h.object, h.triangle);
  };
  for (const char* isa : {"sse2", "avx2", ""}) {
    const tests::HeldVariable held("SONARD_EMBREE_ISA", isa);
    const RayScene rays(scene, 1);
    const PingScalars scalars = make_scalars(plan, request, rays.origin());
    std::vector<FanHit> alone;
    for (int k = 0; k < plan.columns.count; ++k) trace_fixed_fan(rays, plan, scalars, k, k + 1, alone);
    ASSERT_GT(alone.size(), 10u * static_cast<std::size_t>(plan.columns.count)) << "the test needs hits and misses";
    ASSERT_LT(alone.size(), 37u * static_cast<std::size_t>(plan.columns.count));
    for (const int together : {2, 3, 7, plan.columns.count}) {
      std::vector<FanHit> hits;
      for (int k = 0; k < plan.columns.count; k += together)
        trace_fixed_fan(rays, plan, scalars, k, std::min(k + together, plan.columns.count), hits);
      ASSERT_EQ(hits.size(), alone.size()) << together << " columns, " << isa;
      for (std::size_t i = 0; i < hits.size(); ++i)
        ASSERT_EQ(fields(hits[i]), fields(alone[i])) << together << " columns, " << isa << ", hit " << i;
    }
  }
}

// Kernels compute several vectors of values together. A value's code does not depend on the values beside it.
TEST(KernelSets, CodesDoNotDependOnTheNumberOfValues) {
  constexpr int most = 80;
  std::vector<float> power;
  for (int i = 0; i < most; ++i) power.push_back(std::pow(1.1f, static_cast<float>(i - 70)));
  const simd::CodeScale scale{0.25f, 255, 0.5f, 255};
  for (const simd::Kernels* kernels : kernel_sets()) {
    const auto codes = [&](int at_once) {
      std::vector<float> all(3 * most);
      std::vector<std::uint8_t> bytes(most);
      for (int i = 0; i < most; i += at_once) {
        kernels->quantise(power.data() + i, 0.9f, scale, all.data() + i, at_once);
        kernels->quantise_levels(power.data() + i, 0.9f, 10, 200, 255, all.data() + most + i, at_once);
        kernels->quantise_bytes(power.data() + i, 0.9f, scale, bytes.data() + i, at_once);
      }
      std::copy(bytes.begin(), bytes.end(), all.begin() + 2 * most);
      return all;
    };
    const std::vector<float> apart = codes(16), together = codes(most);
    EXPECT_EQ(apart, together) << kernels->name;
    for (std::size_t i = 0; i < most; ++i) EXPECT_EQ(apart[i], apart[2 * most + i]) << kernels->name << ", value " << i;
    EXPECT_LT(apart[0] + 20, apart[most - 1]);
  }
}

// The powers of rows and beams are at their own places, also those at the edges that do not fill a vector.
TEST(KernelSets, DetectsEveryRowOfEveryBeam) {
  constexpr int beams = 37, rows = 45, width = 48, stride = 96;
  std::vector<float> signals(beams * stride);
  for (std::size_t i = 0; i < signals.size(); ++i) signals[i] = std::sin(static_cast<float>(i));
  for (const simd::Kernels* kernels : kernel_sets()) {
    std::vector<float> power(rows * width);
    kernels->detect(signals.data(), stride, beams, rows, power.data(), width);
    for (std::size_t row = 0; row < rows; ++row)
      for (std::size_t j = 0; j < beams; ++j) {
        const float re = signals[j * stride + 2 * row], im = signals[j * stride + 2 * row + 1];
        ASSERT_NEAR(power[row * width + j], re * re + im * im, 1e-6f) << kernels->name << ", row " << row << ", beam " << j;
      }
  }
}

// SONARD_SIMD limits every engine without an explicit level, including those of the tests.
TEST(KernelSets, TheEnvironmentNamesTheAutomaticOne) {
  for (const auto& [name, level] : {std::pair{"portable", SimdLevel::portable},
                                    {"avx2", SimdLevel::avx2},
                                    {"avx512", SimdLevel::avx512},
                                    {"neon", SimdLevel::neon}}) {
    const tests::HeldVariable held("SONARD_SIMD", name);
    EXPECT_EQ(&simd::kernels_for(SimdLevel::automatic), &simd::kernels_for(level)) << name;
    EXPECT_EQ(&simd::kernels_for(SimdLevel::portable), &simd::portable_kernels) << "SONARD_SIMD changes no explicit level";
  }
  const tests::HeldVariable none("SONARD_SIMD", "");
  EXPECT_EQ(&simd::kernels_for(SimdLevel::automatic), &simd::kernels_for(SimdLevel::avx512)) << "the best there is";
  const tests::HeldVariable unknown("SONARD_SIMD", "avx1024");
  EXPECT_THROW(simd::kernels_for(SimdLevel::automatic), std::runtime_error);
}

// If a level is missing, only a level of the processor's own family replaces it.
TEST(KernelSets, NeonIsOfArmProcessorsAlone) {
#if defined(__aarch64__)
  for (const SimdLevel level : {SimdLevel::neon, SimdLevel::avx2, SimdLevel::avx512})
    EXPECT_STREQ(simd::kernels_for(level).name, "neon");
#else
  EXPECT_EQ(&simd::kernels_for(SimdLevel::neon), &simd::portable_kernels);
#endif
}

}  // namespace
}  // namespace sonar::test
