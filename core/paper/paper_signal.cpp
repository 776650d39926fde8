#include "core/paper/paper_signal.hpp"

#include <algorithm>
#include <cmath>

namespace sonar::paper {
namespace {

constexpr double widest_half_angle_rad = 1.48;  // 85 degrees: an image plane has no pixels at 90

/// Width of each column: half the distance between its neighbours; for an outermost column, the distance to its neighbour.
std::vector<double> widths_of(const std::vector<double>& centres, double lone) {
  const std::size_t n = centres.size();
  if (n < 2) return std::vector<double>(n, lone);
  std::vector<double> widths(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, n - 1);
    widths[i] = (centres[before] - centres[after]) / static_cast<double>(after - before);
  }
  return widths;
}

void tabulate(PaperFan& fan) {
  // A direction is computed from the values of its column and of its row.
  for (const double azimuth : fan.azimuth_rad)
    fan.ahead.push_back(fan.perspective ? Vec3d{1, std::tan(azimuth), 0} : Vec3d{std::cos(azimuth), std::sin(azimuth), 0});
  for (int row = 0; row < fan.rows; ++row) {
    // Elevation [rad], or its tangent on the image plane.
    const double up = fan.first_row + row * fan.row_step;
    fan.level.push_back(fan.perspective ? 1 : std::cos(up));
    fan.rise.push_back(fan.perspective ? up : std::sin(up));
  }
}

}  // namespace

PaperFan make_paper_fan(const PingPlan& plan, Mode mode, int rays) {
  PaperFan fan;
  fan.perspective = mode == Mode::raster;
  fan.rows = rays > 0 ? rays : fan.perspective ? default_raster_rows : default_rays;
  // Half of the fan's angle. The fan's angle is twice the quoted width, as in Choi 2025 (P25).
  const double vertical = std::min(static_cast<double>(plan.mode.pattern.elevation_width_rad), widest_half_angle_rad);
  const double top = fan.perspective ? std::tan(vertical) : vertical;
  fan.row_step = 2 * top / fan.rows;
  // Rows lie in the middle of equal steps.
  fan.first_row = -top + 0.5 * fan.row_step;

  const double aperture = static_cast<double>(plan.mode.horizontal_aperture_rad);
  if (!fan.perspective) {
    // A column has a constant azimuth; it is not a cone about the array (oracle 46).
    for (const double sine : plan.beam_sine) fan.azimuth_rad.push_back(std::asin(sine));
    fan.column_width = widths_of(fan.azimuth_rad, aperture);
    tabulate(fan);
    return fan;
  }
  // Pixels are uniform in the tangent of azimuth.
  const double side = std::tan(std::min(0.5 * aperture, widest_half_angle_rad));
  const int columns = plan.settings.beam_count;
  for (int i = 0; i < columns; ++i) fan.azimuth_rad.push_back(std::atan(side * (1 - (2.0 * i + 1) / columns)));
  fan.column_width.assign(static_cast<std::size_t>(columns), 2 * side / columns);
  tabulate(fan);
  return fan;
}

Vec3d PaperFan::direction(int column, int row) const {
  const Vec3d& to = ahead[static_cast<std::size_t>(column)];
  const auto r = static_cast<std::size_t>(row);
  if (!perspective) return {level[r] * to.x, level[r] * to.y, rise[r]};
  const Vec3d pixel{1, to.y, rise[r]};
  return (1 / length(pixel)) * pixel;
}

double PaperFan::solid_angle_sr(int column, int row) const {
  const double cell = column_width[static_cast<std::size_t>(column)] * row_step;
  // The solid angle [sr] of P25's eq. (2) as printed: dtheta dphi, without cos(phi).
  if (!perspective) return cell;
  const double x = direction(column, row).x;  // a pixel of the plane x = 1 has the solid angle dy dz x^3
  return cell * x * x * x;
}

void trace_column(const RayScene& scene, const PaperFan& fan, const PingScalars& scalars, int column, float far_m,
                  std::vector<PaperHit>& hits) {
  RayPacket packet{};
  const Vec3 origin = scalars.position_in_scene;
  for (int from = 0; from < fan.rows; from += RayPacket::size) {
    const int count = std::min(RayPacket::size, fan.rows - from);
    for (int lane = 0; lane < count; ++lane) {
      const Vec3 along = to_float(scalars.world_from_sonar * fan.direction(column, from + lane));
      packet.origin_x[lane] = origin.x, packet.origin_y[lane] = origin.y, packet.origin_z[lane] = origin.z;
      packet.direction_x[lane] = along.x, packet.direction_y[lane] = along.y, packet.direction_z[lane] = along.z;
      packet.far[lane] = far_m;
    }
    scene.trace(packet, count == RayPacket::size ? 0xFFFFu : (1u << count) - 1u, true);
    for (int lane = 0; lane < count; ++lane) {
      if (packet.object[lane] == RayPacket::miss) continue;
      const Vec3 normal{packet.normal_x[lane], packet.normal_y[lane], packet.normal_z[lane]};
      const Vec3 along{packet.direction_x[lane], packet.direction_y[lane], packet.direction_z[lane]};
      // Triangles without an area have no normal.
      if (!(length(normal) > 0)) continue;
      const int row = from + lane;
      hits.push_back({column, row, static_cast<double>(packet.far[lane]), fan.elevation_rad(column, row),
                      std::min(1.0, static_cast<double>(std::abs(dot(normal, along)) / length(normal))),
                      fan.solid_angle_sr(column, row), packet.object[lane], packet.triangle[lane]});
    }
  }
}

namespace {

using spectral::Complex;
using spectral::turned;

// Number of steps between samples at which the power of a pulse is tabulated. Long records have fewer steps, to limit the
// memory.
constexpr std::size_t largest_power_table = std::size_t{1} << 22;  // values
constexpr int most_steps = 64;

}  // namespace

PaperSpectrum make_spectrum(const PingPlan& plan) {
  PaperSpectrum s;
  s.samples = plan.samples;
  s.sample_offset = plan.sample_offset - plan.start_samples;
  // The length T [s] of the record, in two-way travel time.
  const double record_s = plan.samples * 2 * plan.sample_spacing_m / static_cast<double>(plan.settings.device_sound_speed_mps);
  // Choi 2025, eq. 4: df = 1 / T, M = b T frequencies about the carrier.
  const double band = plan.envelope_hz * record_s;                  // b T, in units of df
  s.count = std::max(1, static_cast<int>(std::ceil(band - 1e-3)));  // rounding may make b T slightly larger than a whole number
  s.first_frequency = 1 - 0.5 * band;                               // f_min = f_c - b / 2, m from 1
  double sum = 0;
  for (int m = 0; m < s.count; ++m) {
    const double x = pi * (s.first_frequency + m) / band;  // (f - f_c) pi / b
    // Choi 2025, eq. 3: |S(f)| = e^{-(pi (f - f_c) / b)^2}, normalised to sum 1.
    s.weight.push_back(std::exp(-x * x));
    sum += s.weight.back();
  }
  for (double& w : s.weight) w /= sum;
  return s;
}

void PaperEchoes::push_back(const PaperEcho& e) {
  turns.push_back(e.turns);
  re.push_back(e.amplitude.real());
  im.push_back(e.amplitude.imag());
}

void sum_frequencies(const PaperEchoes& echoes, const PaperSpectrum& spectrum, const spectral::FrequencySums* fast,
                     const simd::Kernels& kernels, SumScratch& scratch, std::span<std::complex<float>> out) {
  std::vector<Complex>& sums = scratch.sums;
  // The sum of eq. 1 over scatterers at every frequency, with a non-uniform transform or term by term.
  if (fast) {
    sums.resize(static_cast<std::size_t>(spectrum.count));
    scratch.grid.assign(static_cast<std::size_t>(fast->grid_points() + fast->padding), 0.0);
    // FrequencySums counts from the middle frequency. The amplitudes already contain the carriers.
    const double middle = spectrum.first_frequency + spectrum.count / 2;
    fast->add(echoes.turns, echoes.re, echoes.im, middle, kernels, scratch.grid.data());
    fast->transform(scratch.grid.data(), sums.data());
  } else {
    std::vector<spectral::Arrival> arrivals;
    for (std::size_t i = 0; i < echoes.size(); ++i) arrivals.push_back({echoes[i].turns, echoes[i].amplitude});
    sums = spectral::direct_sum(arrivals, {spectrum.first_frequency, 1.0, spectrum.count});
  }
  for (std::size_t m = 0; m < sums.size(); ++m) out[m] = std::complex<float>(spectrum.weight[m] * sums[m]);
}

std::vector<float> make_correction(std::span<const double> azimuth_rad, double spacing_rad, bool squared) {
  std::vector<double> v;
  double energy = 0;
  for (const double to : azimuth_rad)
    for (const double from : azimuth_rad) {
      // The weights as in the authors' code: |sin y / y| for the angle between two beams, normalised by the energy of all
      // weights.
      const double y = pi * 0.884 / spacing_rad * std::sin(to - from);
      v.push_back(std::abs(y) < 1e-12 ? 1.0 : std::abs(std::sin(y) / y));
      energy += v.back() * v.back();
    }
  std::vector<float> weights;
  weights.reserve(v.size());
  for (const double x : v) weights.push_back(static_cast<float>(squared ? x * x / energy : x / std::sqrt(energy)));
  return weights;
}

std::unique_ptr<BeamTransformTables> even_correction(std::span<const double> azimuth_rad, double spacing_rad) {
  const std::size_t n = azimuth_rad.size();
  if (n < 2) return nullptr;
  // Azimuths must be uniform to 1e-9 rad. Otherwise the correction is not a convolution.
  const double step = (azimuth_rad.back() - azimuth_rad.front()) / static_cast<double>(n - 1);
  std::vector<double> v;
  double energy = 0;
  for (std::size_t d = 0; d < n; ++d) {
    if (std::abs(azimuth_rad[d] - azimuth_rad[0] - static_cast<double>(d) * step) > 1e-9) return nullptr;
    // This is the weight of make_correction(). Among n azimuths, n - d pairs are d apart in each direction.
    const double y = pi * 0.884 / spacing_rad * std::sin(static_cast<double>(d) * step);
    v.push_back(d == 0 ? 1.0 : std::abs(std::sin(y) / y));
    energy += v.back() * v.back() * static_cast<double>(n - d) * (d == 0 ? 1 : 2);
  }
  for (double& x : v) x /= std::sqrt(energy);
  return std::make_unique<BeamTransformTables>(v);
}

void correct(const BeamTransformTables& even, std::span<const float> in, int values, const simd::Kernels& kernels, Parallel& pool,
             std::span<float> out) {
  constexpr int block = 32;
  std::vector<AlignedFloats> work(static_cast<std::size_t>(pool.threads()), AlignedFloats(even.work_floats()));
  // Each value is corrected separately, so that sums do not depend on the number of threads.
  pool.for_each(static_cast<std::size_t>(values / block), [&](std::size_t b, int worker) {
    kernels.transform_beams(even.tables(), in.data() + b * block, values, block, work[static_cast<std::size_t>(worker)].data(),
                            out.data() + b * block, values);
  });
}

std::vector<float> panels_of(std::span<const float> weights, int beams, int columns) {
  const auto b = static_cast<std::size_t>(beams), c = static_cast<std::size_t>(columns);
  std::vector<float> panels((b + 3) / 4 * 4 * c, 0.0f);
  for (std::size_t j = 0; j < b; ++j)
    for (std::size_t k = 0; k < c; ++k) panels[(j / 4 * c + k) * 4 + j % 4] = weights[j * c + k];
  return panels;
}

void correct(std::span<const float> panels, int beams, int columns, std::span<const float> in, int values,
             const simd::Kernels& kernels, Parallel& pool, std::span<float> out) {
  constexpr int block = 128;  // number of values of a block: a block of all columns stays in the second-level cache
  const auto length = static_cast<std::size_t>(values), count = static_cast<std::size_t>(columns);
  std::vector<std::vector<float>> windows(static_cast<std::size_t>(pool.threads()));
  pool.for_each((length + block - 1) / block, [&](std::size_t b, int worker) {
    const std::size_t from = b * block, n = std::min<std::size_t>(block, length - from);
    std::vector<float>& window = windows[static_cast<std::size_t>(worker)];
    window.assign(count * block, 0.0f);
    for (std::size_t k = 0; k < count; ++k) std::copy_n(in.data() + k * length + from, n, window.data() + k * block);
    for (int j = 0; j < beams; j += 4) {
      float sums[4 * block];
      kernels.form_beam_panel(window.data(), block, panels.data() + static_cast<std::size_t>(j) * count, columns, sums, block);
      for (int i = 0; i < 4 && j + i < beams; ++i)
        std::copy_n(sums + i * block, n, out.data() + static_cast<std::size_t>(j + i) * length + from);
    }
  });
}

InverseTransform::InverseTransform(const PaperSpectrum& spectrum) : grid_(spectrum) {
  const double samples = spectrum.samples;
  if (spectral::have_transform) inverse_ = std::make_unique<spectral::Fft>(spectrum.samples, spectral::Fft::Direction::inverse);
  // t_0: sample 0 lies sample_offset after the record's beginning.
  for (int m = 0; m < spectrum.count; ++m)
    half_turn_.push_back(turned((spectrum.first_frequency + m) * spectrum.sample_offset / samples));
  for (int n = 0; n < spectrum.samples; ++n) {
    root_.push_back(turned(n / samples));
    baseband_.push_back(turned(n * spectrum.first_frequency / samples));
  }
}

void InverseTransform::run(std::span<const std::complex<float>> spectrum, std::vector<Complex>& work, float* out) const {
  // Frequencies that differ by a multiple of the sample rate have the same samples. Therefore they share an element.
  const auto n = static_cast<std::size_t>(grid_.samples);
  work.assign(n, {});
  for (std::size_t m = 0; m < spectrum.size(); ++m) work[m % n] += Complex(spectrum[m]) * half_turn_[m];
  if (inverse_) {
    inverse_->run(work.data());
  } else {
    std::vector<Complex> sums(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t m = 0; m < n; ++m) sums[i] += work[m] * root_[i * m % n];
    work.swap(sums);
  }
  // The transform counts frequencies from 0. The factor e^{i 2 pi f_1 t_n} shifts them to f_1.
  for (std::size_t i = 0; i < n; ++i) {
    const Complex s = work[i] * baseband_[i];
    out[2 * i] = static_cast<float>(s.real()), out[2 * i + 1] = static_cast<float>(s.imag());
  }
}

PulsePower::PulsePower(const PaperSpectrum& spectrum, const InverseTransform& inverse)
    : samples_(spectrum.samples), offset_(spectrum.sample_offset) {
  const auto n = static_cast<std::size_t>(samples_);
  steps_ = static_cast<int>(std::clamp<std::size_t>(largest_power_table / n, 1, most_steps));
  std::vector<std::complex<float>> lone(static_cast<std::size_t>(spectrum.count));
  std::vector<Complex> work;
  std::vector<float> signal(2 * n);
  SumScratch scratch;
  for (int step = 0; step <= steps_; ++step) {  // the echo lies step / steps of a sample after sample 0
    PaperEchoes echo;
    echo.push_back({(offset_ + static_cast<double>(step) / steps_) / samples_, {1, 0}});
    sum_frequencies(echo, spectrum, nullptr, simd::kernels_for(SimdLevel::automatic), scratch, lone);
    inverse.run(lone, work, signal.data());
    for (std::size_t i = 0; i < n; ++i) table_.push_back(signal[2 * i] * signal[2 * i] + signal[2 * i + 1] * signal[2 * i + 1]);
  }
}

void PulsePower::add(const PaperEcho& echo, std::span<float> power) const {
  const double place = echo.turns * samples_ - offset_, whole = std::floor(place);
  const auto step = std::min(static_cast<std::size_t>((place - whole) * steps_ + 0.5), static_cast<std::size_t>(steps_));
  const float* pulse = table_.data() + step * static_cast<std::size_t>(samples_);
  const auto scale = static_cast<float>(echo.amplitude.real());
  const auto shift = static_cast<std::size_t>(((static_cast<int>(whole) % samples_) + samples_) % samples_);
  const std::size_t n = power.size();  // the record is periodic: a pulse that extends beyond its end continues at its beginning
  for (std::size_t i = shift; i < n; ++i) power[i] += scale * pulse[i - shift];
  for (std::size_t i = 0; i < shift; ++i) power[i] += scale * pulse[n - shift + i];
}

}  // namespace sonar::paper
