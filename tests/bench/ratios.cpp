#include "tests/bench/ratios.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/receive.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar::bench {
namespace {

constexpr int tries = 7, window_samples = 64;

PingPlan plan_of(const char* name) {
  const BenchCase c = *find_case(name);
  return make_plan(c.profile.model->modes[static_cast<std::size_t>(c.settings.mode)], c.settings, {});
}

template <class Floats>
void fill_with_noise(Floats& values) {
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    const Random4 draw = philox(static_cast<std::uint32_t>(i), 0, 0, 0, 7, 0);
    const ComplexNormal z = complex_normal(draw.v[0], draw.v[1]);
    values[i] = z.re, values[i + 1] = z.im;
  }
}

/// Returns the time of the coupling of a whole record, window by window; `kept` receives the beams of the last window.
double form_beams_ms(const ColumnSignals& columns, const PingPlan& plan, const BeamWeights& beam_weights,
                     const simd::Kernels& kernels, BeamSignals& kept) {
  BeamScratch scratch;
  return best_ms(tries, [&] {
    for (int first = 0; first < plan.samples; first += window_samples) {
      kept.shape(plan.settings.beam_count, first, std::min(window_samples, plan.samples - first));
      form_beams(columns, beam_weights, kernels, scratch, kept);
    }
  });
}

double difference(const BeamSignals& truth, const BeamSignals& other) {
  double off = 0, all = 0;
  for (int j = 0; j < truth.beams; ++j)
    for (int i = 0; i < 2 * truth.samples; ++i) {
      const auto a = static_cast<double>(truth.beam(j)[i]), b = static_cast<double>(other.beam(j)[i]);
      off += (a - b) * (a - b), all += a * a;
    }
  return std::sqrt(off / all);
}

/// The simplest implementation, for comparison: magnitude, gain and power law of every sample, beam by beam.
void detect_naively(const std::vector<float>& signal, const PingPlan& plan, std::vector<std::byte>& codes) {
  const PingSettings& s = plan.settings;
  for (int j = 0; j < s.beam_count; ++j)
    for (int row = 0; row < s.range_bin_count; ++row) {
      const std::size_t at =
          2 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(s.range_bin_count) + static_cast<std::size_t>(row));
      const float magnitude = std::hypot(signal[at], signal[at + 1]);
      const float gain = std::sqrt(plan.row_power_factor[static_cast<std::size_t>(row)]);
      const float value = std::pow(magnitude * gain, s.format.gamma) * static_cast<float>(s.format.max_code);
      codes[static_cast<std::size_t>(row) * static_cast<std::size_t>(s.beam_count) + static_cast<std::size_t>(j)] =
          static_cast<std::byte>(std::min(value + 0.5f, static_cast<float>(s.format.max_code)));
    }
}

/// Returns the time of all rays of a sparse fan over P1's columns, with `lanes` rays in each packet.
double trace_ms(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int lanes) {
  return best_ms(3, [&] {
    RayPacket packet{};
    std::uint32_t hits = 0;
    for (const float elevation : plan.fan.elevation_rad)
      for (int from = 0; from < plan.columns.count; from += lanes) {
        const int count = std::min(lanes, plan.columns.count - from);
        for (int i = 0; i < count; ++i) {
          const double sine = std::clamp(plan.columns.sine(from + i), -1.0, 1.0);
          const Vec3 along = to_float(scalars.world_from_sonar * sonar_from_conical({sine, static_cast<double>(elevation)}));
          packet.origin_x[i] = scalars.position_in_scene.x, packet.origin_y[i] = scalars.position_in_scene.y;
          packet.origin_z[i] = scalars.position_in_scene.z;
          packet.direction_x[i] = along.x, packet.direction_y[i] = along.y, packet.direction_z[i] = along.z;
          packet.far[i] = static_cast<float>(scalars.max_range_m);
        }
        scene.trace(packet, (1u << count) - 1u, true);
        hits += packet.object[0] != RayPacket::miss;
      }
    if (hits == 0) std::fprintf(stderr, "sonard_bench: the rays hit nothing\n");
  });
}

}  // namespace

std::vector<Ratio> measure_beam_weights(const BenchOptions& options) {
  const simd::Kernels& kernels = simd::kernels_for(options.engine.simd);
  std::vector<Ratio> ratios;
  for (const char* name : {"P1", "P3a"}) {
    const PingPlan plan = plan_of(name);
    ColumnSignals columns;
    columns.shape(plan.columns.count, plan.samples, plan.taps);
    fill_with_noise(columns.data);
    const BeamWeightOptions all{.dropped_energy = 0, .transform = false}, band{.dropped_energy = 1e-4, .transform = false};
    const auto made = [&](const BeamWeightOptions& o) {
      return make_beam_weights(plan.mode, plan.columns, plan.beam_sine, false, o);
    };
    BeamSignals truth, banded, ours;
    const double dense_ms = form_beams_ms(columns, plan, made(all), kernels, truth);
    const double band_ms = form_beams_ms(columns, plan, made(band), kernels, banded);
    const double ours_ms = form_beams_ms(columns, plan, plan.beam_weights, kernels, ours);
    const std::string of = std::string(", ") + name;
    ratios.push_back({"beams: dense / ours" + of, dense_ms, ours_ms, 1.2, 1, difference(truth, ours)});
    ratios.push_back({"beams: band of -40 dB / ours" + of, band_ms, ours_ms, 0, 1, difference(truth, banded)});
  }
  return ratios;
}

std::vector<Ratio> measure_rays(std::shared_ptr<const Scene> scene, const BenchScene& where, const BenchOptions& options) {
  const BenchCase c = *find_case("P1");
  const PingPlan plan = plan_of("P1");
  const RayScene rays(std::move(scene), 1);
  const PingScalars scalars = make_scalars(plan, Pinger(c, options).request(0, bench_pose(c, where, 0)), rays.origin());
  return {{"rays: one by one / full packets", trace_ms(rays, plan, scalars, 1), trace_ms(rays, plan, scalars, 16), 1.2, 1, 0}};
}

std::vector<Ratio> measure_detection(const BenchOptions& options) {
  const simd::Kernels& kernels = simd::kernels_for(options.engine.simd);
  const PingPlan plan = plan_of("P1");
  const PingSettings& s = plan.settings;
  std::vector<float> signal(2 * static_cast<std::size_t>(s.beam_count) * static_cast<std::size_t>(s.range_bin_count));
  fill_with_noise(signal);
  std::vector<std::byte> codes(signal.size() / 2);
  const double naive_ms = best_ms(3, [&] { detect_naively(signal, plan, codes); });

  BeamSignals beams;
  beams.beams = s.beam_count, beams.samples = window_samples, beams.stride = 2 * window_samples;
  beams.data.resize(static_cast<std::size_t>(beams.stride) * static_cast<std::size_t>(beams.beams));
  fill_with_noise(beams.data);
  ReceiveScratch scratch;
  Ping ping;
  shape_ping(plan, {}, ping);
  const double ours_ms = best_ms(tries, [&] {
    for (int first = 0; first < plan.samples; first += window_samples) {
      beams.first_sample = first;
      beams.samples = std::min(window_samples, plan.samples - first);
      receive(beams, plan, kernels, scratch, ping);
    }
  });
  // The portable loops gain only by their tiles; without vectors this gain is within the machine's noise.
  const double least = &kernels == &simd::portable_kernels ? 0 : 2;
  return {{"samples: one by one / tiles", naive_ms, ours_ms, least, 1, 0}};
}

void print(const Ratio& r) {
  std::printf("P6   %-62s %9.2f ms / %7.3f ms = %7.1f", r.name.c_str(), r.slow_ms, r.fast_ms, r.ratio());
  if (r.least > 0) std::printf(" (at least %g%s)", r.least, r.holds() ? "" : ": MISSED");
  if (r.difference > 0) std::printf(", differ by %.1e", r.difference);
  std::printf("\n");
  std::fflush(stdout);
}

nlohmann::json json_of(const Ratio& r) {
  return {{"name", r.name},
          {"slow_ms", r.slow_ms},
          {"fast_ms", r.fast_ms},
          {"ratio", r.ratio()},
          {"least", r.least},
          {"holds", r.holds()},
          {"share_measured", r.share_measured},
          {"difference", r.difference}};
}

}  // namespace sonar::bench
