#include "core/pipeline/receive.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/pipeline/arithmetic/receiver.hpp"

namespace sonar {
namespace {

/// Computes the mean power of each row, and transposes the result so that the beams of a row are neighbours.
void detect(const BeamSignals& beams, const PingPlan& plan, const simd::Kernels& kernels, int rows, int width,
            std::vector<float>& power) {
  const int per_row = plan.settings.samples_per_row;
  power.resize(static_cast<std::size_t>(rows) * static_cast<std::size_t>(width));
  // Power |s|^2 per sample. A row of several samples gets their mean power (docs/acoustics.md, section 7).
  if (per_row == 1 && !plan.expected_power) {
    kernels.detect(beams.data.data(), beams.stride, beams.beams, rows, power.data(), width);
    return;
  }
  constexpr int block = 16;  // number of beams whose rows stay in the first-level cache during the transposition
  for (int from = 0; from < beams.beams; from += block) {
    const int to = std::min(from + block, beams.beams);
    for (int row = 0; row < rows; ++row)
      for (int j = from; j < to; ++j) {
        const float* s = beams.beam(j) + 2 * row * per_row;
        // In expected power, re is already a power.
        float sum = 0;
        for (int q = 0; q < per_row; ++q)
          sum += plan.expected_power ? s[2 * q] : s[2 * q] * s[2 * q] + s[2 * q + 1] * s[2 * q + 1];
        power[static_cast<std::size_t>(row * width + j)] = sum / static_cast<float>(per_row);
      }
  }
}

/// Copies the part of [samples][beams] that belongs to the window.
void keep_signal(const BeamSignals& beams, std::vector<std::complex<float>>& kept) {
  for (int j = 0; j < beams.beams; ++j) {
    const float* s = beams.beam(j);
    for (int n = 0; n < beams.samples; ++n) {
      // Windows are separate parts of the array, so workers need no locks.
      const std::size_t at = static_cast<std::size_t>(beams.first_sample + n) * static_cast<std::size_t>(beams.beams);
      kept[at + static_cast<std::size_t>(j)] = {s[2 * n], s[2 * n + 1]};
    }
  }
}

/// Stores a code, little-endian.
void put(std::uint32_t code, int bytes, std::byte* at) {
  for (int b = 0; b < bytes; ++b) at[b] = static_cast<std::byte>(code >> (8 * b) & 0xFFu);
}

}  // namespace

void shape_ping(const PingPlan& plan, const Switches& switches, Ping& ping) {
  const PingSettings& s = plan.settings;
  const auto cells = static_cast<std::size_t>(s.range_bin_count) * static_cast<std::size_t>(s.beam_count);
  ping.beam_azimuth_rad = plan.beam_azimuth_rad;
  ping.samples.resize(cells * static_cast<std::size_t>(s.format.bits / 8));
  ping.row_gain = plan.row_gain;
  if (switches.keep_pressure) ping.pressure_upa.resize(cells);
  if (switches.keep_beams && !plan.expected_power)
    ping.beam_signal_upa.resize(static_cast<std::size_t>(plan.samples) * static_cast<std::size_t>(s.beam_count));
}

void receive(const BeamSignals& beams, const PingPlan& plan, const simd::Kernels& kernels, ReceiveScratch& scratch, Ping& ping) {
  const PingSettings& s = plan.settings;
  const int per_row = s.samples_per_row, first_row = beams.first_sample / per_row, rows = beams.samples / per_row;
  // Kernels work on whole vectors of beams.
  const int width = (s.beam_count + 15) / 16 * 16;
  const int bytes = s.format.bits / 8;
  if (!ping.beam_signal_upa.empty()) keep_signal(beams, ping.beam_signal_upa);
  detect(beams, plan, kernels, rows, width, scratch.power);
  scratch.codes.resize(static_cast<std::size_t>(width));
  scratch.bytes.resize(static_cast<std::size_t>(width));
  const auto max_code = static_cast<float>(s.format.max_code);
  const simd::CodeScale scale{s.format.gamma / 2, plan.truncates() ? max_code + 1 : max_code, plan.truncates() ? 0.0f : 0.5f,
                              max_code};
  const bool logarithmic = s.format.scale == SampleFormat::Scale::logarithmic;
  const LevelLine line = level_line(s.format);
  const auto per_octave = static_cast<float>(line.per_octave), at_full_scale = static_cast<float>(line.at_full_scale);
  // The gain (eq. 36) depends on the row in the picture, not on the row in the window.
  for (int row = 0; row < rows; ++row) {
    float* power = scratch.power.data() + static_cast<std::ptrdiff_t>(row) * width;
    const std::size_t at = static_cast<std::size_t>(first_row + row) * static_cast<std::size_t>(s.beam_count);
    if (!ping.pressure_upa.empty())
      for (int j = 0; j < s.beam_count; ++j) ping.pressure_upa[at + static_cast<std::size_t>(j)] = std::sqrt(power[j]);
    for (std::size_t j = 0; j < plan.beam_power_factor.size(); ++j) power[j] *= plan.beam_power_factor[j];
    // Eq. 37: code = max_code (|s| / full scale)^gamma. It is computed as power times (gain TVG / full scale)^2, to the power
    // gamma / 2.
    const float gain = plan.row_power_factor[static_cast<std::size_t>(first_row + row)];
    std::byte* out = ping.samples.data() + at * static_cast<std::size_t>(bytes);
    if (bytes == 1 && !logarithmic) {
      kernels.quantise_bytes(power, gain, scale, scratch.bytes.data(), width);
      std::memcpy(out, scratch.bytes.data(), static_cast<std::size_t>(s.beam_count));
      continue;
    }
    // Eq. 40 is a straight line in log2 of the power.
    if (logarithmic)
      kernels.quantise_levels(power, gain, per_octave, at_full_scale, max_code, scratch.codes.data(), width);
    else
      kernels.quantise(power, gain, scale, scratch.codes.data(), width);
    if (bytes == 2) {  // most sonars send two bytes; the loop becomes vector code
      for (int j = 0; j < s.beam_count; ++j) {
        const auto code = static_cast<std::uint16_t>(static_cast<std::int32_t>(scratch.codes[static_cast<std::size_t>(j)]));
        std::memcpy(out + 2 * j, &code, 2);
      }
      continue;
    }
    for (int j = 0; j < s.beam_count; ++j) {
      // 2^32 - 1 is not representable as a float. The comparison comes before the conversion, because the conversion could
      // overflow.
      const float code = scratch.codes[static_cast<std::size_t>(j)];
      put(code >= max_code ? s.format.max_code : static_cast<std::uint32_t>(code), bytes,
          out + static_cast<std::ptrdiff_t>(j) * bytes);
    }
  }
}

}  // namespace sonar
