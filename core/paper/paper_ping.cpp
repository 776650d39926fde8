#include "core/paper/paper_ping.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/units.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/receive.hpp"
#include "core/sonar/bearings.hpp"

namespace sonar::paper {
namespace {

constexpr int sum_width = 8;              // grid points for each echo in the fast sum; its relative error is 1e-7
constexpr double width_constant = 0.884;  // from the code of Choi 2025 (P25), for sinc patterns: -3 dB width times aperture

/// The comparison modes have no motion within the ping.
PingScalars still_scalars(const PingPlan& plan, PingRequest request, Vec3d origin) {
  request.switches.motion = false;
  return make_scalars(plan, request, origin);
}

std::vector<double> coefficients(const Scene& scene) {
  std::vector<double> mu;
  // mu [1/sr] by material. P25 has only Lambert's law.
  for (const Material& m : scene.materials) mu.push_back(lambert_coefficient(static_cast<double>(m.lambert_db)));
  return mu;
}

struct PointInView {
  int column = 0;
  double range_m = 0, elevation_rad = 0, cross_section_m2 = 0;
};

/// P25 has no point targets. Here visible point targets are scatterers of their column, like hits of rays.
std::vector<PointInView> points_in_view(const RayScene& scene, const Prepared& p, const PingScalars& s,
                                        const PingRequest& request) {
  const std::vector<Pose>& bodies = request.bodies_in_world.empty() ? scene.scene().bodies_in_world : request.bodies_in_world;
  std::vector<PointInView> points;
  for (const PointTarget& target : scene.scene().point_targets) {
    const Vec3d in_world = scene.scene().in_world(target, bodies);
    const Vec3d at = transform(inverse(s.seen_from), in_world);
    // A point within 1e-9 m of the sonar has no direction.
    const double range = length(at), azimuth = std::atan2(at.y, at.x), elevation = std::asin(at.z / std::max(range, 1e-9));
    int nearest = 0;
    const auto off = [&](int k) { return std::abs(p.fan.azimuth_rad[static_cast<std::size_t>(k)] - azimuth); };
    for (int k = 1; k < p.fan.columns(); ++k) {
      if (off(k) < off(nearest)) nearest = k;
    }
    // The row whose ray passes nearest to the point. Points outside the fan are not visible.
    const double row = ((p.fan.perspective ? at.z / at.x : elevation) - p.fan.first_row) / p.fan.row_step;
    if (at.x <= 0 || off(nearest) > p.fan.column_width[static_cast<std::size_t>(nearest)] || row < -0.5 || row > p.fan.rows - 0.5)
      continue;
    if (!is_occluded(scene, s.seen_from.position_m, in_world))
      points.push_back({nearest, range, elevation, power_from_db(static_cast<double>(target.target_strength_db))});
  }
  return points;
}

BeamTruth truth_of(std::span<const PaperHit> hits, double half_width_rad) {
  BeamTruth truth;
  for (const PaperHit& hit : hits) {
    if (std::abs(hit.elevation_rad) > half_width_rad) continue;
    if (truth.object == BeamTruth::nothing || hit.range_m < static_cast<double>(truth.range_m))
      truth = {static_cast<float>(hit.range_m), hit.object};
  }
  return truth;
}

/// The stages of one ping, and their data.
class PaperPing {
 public:
  PaperPing(const RayScene& scene, const PingRequest& request, const Prepared& prepared, const simd::Kernels& kernels,
            Parallel& pool, double (*now_s)(), PingStatistics& statistics)
      : scene_(scene),
        request_(request),
        p_(prepared),
        kernels_(kernels),
        s_(still_scalars(prepared.plan, request, scene.origin())),
        mu_(coefficients(scene.scene())),
        pool_(pool),
        now_s_(now_s),
        statistics_(statistics),
        work_(static_cast<std::size_t>(pool.threads())) {
    // Number of floats: one per sample in expected power, else two per frequency. Kernels that form beams need multiples of 32.
    values_ = static_cast<std::size_t>((p_.plan.expected_power ? p_.plan.samples : 2 * p_.spectrum.count) + 31) / 32 * 32;
    columns_.resize(values_ * static_cast<std::size_t>(p_.fan.columns()));
    if (request.switches.keep_truth) truth_.resize(static_cast<std::size_t>(p_.fan.columns()));
  }

  void simulate_columns();
  void correct_beams();
  Ping image();

 private:
  void receive_rows(const BeamSignals& signals, Ping& ping);
  double now() const { return now_s_ ? now_s_() : 0; }
  /// Buffers of one worker.
  struct Work {
    std::vector<PaperHit> hits;
    PaperEchoes echoes;
    SumScratch sum;
    PingStatistics statistics;
  };
  void simulate_column(int column, Work& work);

  const RayScene& scene_;
  const PingRequest& request_;
  const Prepared& p_;
  const simd::Kernels& kernels_;
  PingScalars s_;
  std::vector<double> mu_;
  Parallel& pool_;
  double (*now_s_)();
  PingStatistics& statistics_;
  std::vector<Work> work_;  // per worker
  std::vector<PointInView> points_;
  std::size_t values_ = 0;  // floats per column, a multiple of 32: the spectrum, or the samples in expected power
  std::vector<float> columns_, beams_;
  std::vector<BeamTruth> truth_;
};

void PaperPing::simulate_columns() {
  // A blank ping has no echoes, and these modes have no noise.
  if (request_.blank) return;
  points_ = points_in_view(scene_, p_, s_, request_);
  pool_.for_each(static_cast<std::size_t>(p_.fan.columns()), [&](std::size_t column, int worker) {
    simulate_column(static_cast<int>(column), work_[static_cast<std::size_t>(worker)]);
  });
  // Each worker has its own counters, so that no memory is shared.
  for (const Work& work : work_) {
    const PingStatistics& share = work.statistics;
    for (std::size_t i = 0; i < share.seconds.size(); ++i) statistics_.seconds[i] += share.seconds[i];
    statistics_.rays += share.rays;
    statistics_.echoes += share.echoes;
  }
}

void PaperPing::simulate_column(int column, Work& work) {
  PingStatistics& mine = work.statistics;
  const double begin = now();
  std::vector<PaperHit>& hits = work.hits;
  hits.clear();
  // Traces the rays of one column; echoes_of() below applies eq. 2 to each hit.
  trace_column(scene_, p_.fan, s_, column, static_cast<float>(s_.max_range_m), hits);
  const double traced = now();
  if (!truth_.empty())
    truth_[static_cast<std::size_t>(column)] =
        truth_of(hits, 0.5 * static_cast<double>(p_.plan.mode.pattern.elevation_width_rad));
  PaperEchoes& echoes = work.echoes;
  echoes.turns.clear(), echoes.re.clear(), echoes.im.clear();
  echoes_of(hits, mu_, scene_.scene(), p_, s_, request_, kernels_, echoes);
  for (const PointInView& point : points_) {
    if (point.column == column)
      add_echo(point.range_m, elevation_pattern(p_, point.elevation_rad), point.cross_section_m2, {1, 0}, p_, s_, echoes);
  }
  const double scattered = now();
  const std::span<float> out = std::span(columns_).subspan(static_cast<std::size_t>(column) * values_, values_);
  if (p_.plan.expected_power) {
    // Eq. 39: the powers of pulses add in time.
    for (std::size_t i = 0; i < echoes.size(); ++i)
      p_.pulse_power->add(echoes[i], out.first(static_cast<std::size_t>(p_.plan.samples)));
  } else {
    // Eq. 1 for this column, times |S(f)|. The floats of `out` are the real and imaginary parts of complex numbers.
    sum_frequencies(echoes, p_.spectrum, p_.fast.get(), kernels_, work.sum,
                    {reinterpret_cast<std::complex<float>*>(out.data()), static_cast<std::size_t>(p_.spectrum.count)});
  }
  mine.rays += static_cast<std::size_t>(p_.fan.rows);
  mine.echoes += echoes.size();
  mine.seconds[static_cast<std::size_t>(Stage::trace)] += traced - begin;
  mine.seconds[static_cast<std::size_t>(Stage::scatter)] += scattered - traced;
  mine.seconds[static_cast<std::size_t>(Stage::synthesize)] += now() - scattered;
}

void PaperPing::correct_beams() {
  const double begin = now();
  beams_.resize(columns_.size());
  if (p_.even)
    correct(*p_.even, columns_, static_cast<int>(values_), kernels_, pool_, beams_);
  else
    correct(p_.correction, p_.plan.settings.beam_count, p_.fan.columns(), columns_, static_cast<int>(values_), kernels_, pool_,
            beams_);
  statistics_.seconds[static_cast<std::size_t>(Stage::form_beams)] += now() - begin;
}

Ping PaperPing::image() {
  const double begin = now();
  const int beams = p_.plan.settings.beam_count;
  BeamSignals signals;
  signals.beams = beams;
  signals.samples = p_.plan.samples;
  signals.stride = 2 * static_cast<std::ptrdiff_t>(p_.plan.samples);
  signals.data.resize(static_cast<std::size_t>(beams) * static_cast<std::size_t>(signals.stride));
  std::vector<std::vector<spectral::Complex>> work(static_cast<std::size_t>(pool_.threads()));
  pool_.for_each(static_cast<std::size_t>(beams), [&](std::size_t j, int worker) {
    const float* in = beams_.data() + j * values_;
    float* out = signals.beam(static_cast<int>(j));
    // In expected power the values are already samples.
    if (p_.plan.expected_power)
      for (int n = 0; n < p_.plan.samples; ++n) out[2 * n] = in[n];
    else
      p_.inverse.run({reinterpret_cast<const std::complex<float>*>(in), static_cast<std::size_t>(p_.spectrum.count)},
                     work[static_cast<std::size_t>(worker)], out);
  });
  Ping ping;
  ping.request = request_;
  shape_ping(p_.plan, request_.switches, ping);
  for (std::size_t j = 0; j < ping.beam_azimuth_rad.size(); ++j)
    ping.beam_azimuth_rad[j] = static_cast<float>(p_.fan.azimuth_rad[j]);
  ping.truth = truth_;
  receive_rows(signals, ping);
  statistics_.seconds[static_cast<std::size_t>(Stage::receive)] += now() - begin;
  return ping;
}

/// Computes envelope, gain and codes, one window of rows at a time.
void PaperPing::receive_rows(const BeamSignals& signals, Ping& ping) {
  // Rows of a task: few enough for their data to stay in the cache from envelope to codes.
  constexpr int rows_at_once = 64;
  struct Scratch {
    BeamSignals window;
    ReceiveScratch receive;
  };
  std::vector<Scratch> scratch(static_cast<std::size_t>(pool_.threads()));
  const int rows = p_.plan.settings.range_bin_count, per_row = p_.plan.settings.samples_per_row;
  pool_.for_each(static_cast<std::size_t>((rows + rows_at_once - 1) / rows_at_once), [&](std::size_t w, int worker) {
    Scratch& mine = scratch[static_cast<std::size_t>(worker)];
    BeamSignals& window = mine.window;
    const int first = static_cast<int>(w) * rows_at_once, last = std::min(first + rows_at_once, rows);
    window.beams = signals.beams;
    window.first_sample = first * per_row;
    window.samples = (last - first) * per_row;
    window.stride = 2 * window.samples;
    window.data.resize(static_cast<std::size_t>(window.beams) * static_cast<std::size_t>(window.stride));
    for (int j = 0; j < window.beams; ++j) std::copy_n(signals.beam(j) + 2 * window.first_sample, window.stride, window.beam(j));
    receive(window, p_.plan, kernels_, mine.receive, ping);
  });
}

}  // namespace

Prepared::Prepared(const PingRequest& request, FrequencySum sum)
    : model(request.model),
      plan(make_plan(request.model->modes[static_cast<std::size_t>(request.settings.mode)], request.settings, request.switches,
                     bearing_scale_of(request))),
      fan(make_paper_fan(plan, request.switches.mode, request.switches.fixed_fan)),
      spectrum(make_spectrum(plan)),
      inverse(spectrum) {
  if (sum == FrequencySum::fast && spectral::have_transform)
    fast = std::make_unique<spectral::FrequencySums>(spectrum.count, sum_width);
  if (plan.expected_power) pulse_power = std::make_unique<PulsePower>(spectrum, inverse);
  // If the azimuths are uniform, the correction is a convolution and is computed with a transform.
  const double spacing = static_cast<double>(plan.mode.horizontal_aperture_rad) / plan.settings.beam_count;
  if (!plan.expected_power) even = even_correction(fan.azimuth_rad, spacing);
  if (!even)
    correction =
        panels_of(make_correction(fan.azimuth_rad, spacing, plan.expected_power), plan.settings.beam_count, fan.columns());
  // D(phi) = sinc(0.884 sin(phi) / width), one pattern of the quoted width (decision 0010).
  if (plan.mode.pattern.elevation_taper != Taper::unit)
    elevation_per_sine = width_constant / static_cast<double>(plan.mode.pattern.elevation_width_rad);
  // In a fan each row has one elevation. On an image plane the elevation also depends on the column.
  for (int row = 0; row < fan.rows && !fan.perspective; ++row)
    pattern.push_back(elevation_pattern(*this, fan.elevation_rad(0, row)));
}

bool Prepared::serves(const PingRequest& request) const { return request.model == model && sonar::serves(plan, request); }

Ping simulate(const RayScene& scene, const PingRequest& request, const Prepared& prepared, const simd::Kernels& kernels,
              Parallel& pool, double (*now_s)(), PingStatistics& statistics) {
  PaperPing ping(scene, request, prepared, kernels, pool, now_s, statistics);
  ping.simulate_columns();  // trace_column, eq. (2), and the sum of eq. (1) times |S(f)|, one column per beam
  ping.correct_beams();     // with the weights "as coded" in P25's program (make_correction)
  return ping.image();
}

}  // namespace sonar::paper
