// Makes the weights of beams over columns: a band of weights, or the tables of a transform if a transform is faster.
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/plan_tables.hpp"

namespace sonar {

std::vector<ReceivePattern> receive_patterns(const FrequencyMode& mode, std::size_t beams) {
  std::vector<ReceivePattern> patterns(beams, receive_pattern(mode.pattern));
  for (std::size_t j = 0; j < beams && mode.has_own_widths(); ++j) patterns[j] = receive_pattern(mode, j);
  return patterns;
}

namespace {

/// The narrowest band of columns that drops at most the given part of the energy.
struct Band {
  int half = 0;
  double energy = 0, total = 0;  // sum_k W_jk^2 over the band, and over all columns
};
Band band_of(const ReceivePattern& weight, const Columns& columns, double dropped_energy) {
  // W at distances of whole columns. Its square is the energy that a column adds to a beam.
  std::vector<double> energy(static_cast<std::size_t>(columns.count));
  Band band;
  for (int h = 0; h < columns.count; ++h) {
    const double w = weight(h * columns.spacing);
    band.total += energy[static_cast<std::size_t>(h)] = w * w * (h == 0 ? 1 : 2);
  }
  double dropped = 0;
  band.half = columns.count - 1;
  while (band.half > 0 && dropped + energy[static_cast<std::size_t>(band.half)] < dropped_energy * band.total)
    dropped += energy[static_cast<std::size_t>(band.half--)];
  band.energy = band.total - dropped;
  return band;
}

}  // namespace

BeamWeights make_beam_weights(const FrequencyMode& mode, const Columns& columns, const std::vector<double>& beam_sines,
                              bool squared, const BeamWeightOptions& options) {
  const bool alike = !mode.has_own_widths();
  const ReceivePattern nominal = receive_pattern(mode.pattern);
  const std::vector<ReceivePattern> pattern = receive_patterns(mode, beam_sines.size());
  ReceivePattern widest = pattern.empty() ? nominal : pattern.front();
  for (const ReceivePattern& p : pattern)
    if (p.aperture_wavelengths < widest.aperture_wavelengths) widest = p;
  BeamWeights c;
  const Band band = band_of(nominal, columns, options.dropped_energy);
  // Beams with different widths have the same band, that of the widest beam.
  c.half_band = alike ? band.half : band_of(widest, columns, options.dropped_energy).half;
  c.weight_energy = band.energy;
  // Squared weights need a band: the rounding error of a transform is relative to the largest value and would be visible in
  // shadows, because sums of powers do not cancel.
  if (options.transform && !squared && alike && !nominal.unit && beam_sines.size() > 1) {
    auto tables = std::make_shared<const BeamTransformTables>(nominal, columns, beam_sines);
    const double band_cost = static_cast<double>(beam_sines.size()) * std::min(2 * c.half_band + 1, columns.count);
    if (tables->cost() < band_cost) {
      c.transform = std::move(tables);
      c.half_band = columns.count - 1;
      c.weight_energy = band.total;
      return c;
    }
  }

  // A ping of an interleaved picture forms only some beams. If beams have no weights outside their own band, the ping can skip
  // the columns between them.
  const bool own_bands = !alike && mode.interleaved_pings > 1;
  std::vector<int> half_bands(beam_sines.size(), c.half_band);
  for (std::size_t j = 0; own_bands && j < half_bands.size(); ++j)
    half_bands[j] = band_of(pattern[j], columns, options.dropped_energy).half;

  const int beams = static_cast<int>(beam_sines.size());
  const auto nearest_column = [&](int beam) {
    return (columns.first_sine - beam_sines[static_cast<std::size_t>(beam)]) / columns.spacing;
  };
  const bool same_for_all = mode.beam_spacing == BeamSpacing::uniform_in_sine && beams > 1;
  for (int first = 0; first < beams; first += 4) {
    const int last = std::min(first + 3, beams - 1);
    const int from = static_cast<int>(std::floor(nearest_column(first) + 0.5)) - c.half_band;
    const int to = static_cast<int>(std::floor(nearest_column(last) + 0.5)) + c.half_band + 1;
    const int clipped_from = std::max(from, 0), clipped_to = std::min(to, columns.count);
    const bool whole = last == first + 3;
    if (first == 0 || !same_for_all || !whole) {
      c.panels.push_back({first, clipped_from, clipped_to - clipped_from, c.weights.size()});
      // The weights of the first panel are not clipped, because the other panels share them.
      const int start = same_for_all && whole ? from : clipped_from, stop = same_for_all && whole ? to : clipped_to;
      if (start < clipped_from) c.panels.back().weights += 4 * static_cast<std::size_t>(clipped_from - start);
      for (int k = start; k < stop; ++k)
        for (int j = first; j < first + 4; ++j) {
          const auto beam = static_cast<std::size_t>(j);
          const bool in_band = j <= last && (!own_bands || std::abs(k - std::lround(nearest_column(j))) <= half_bands[beam]);
          const double w = in_band ? pattern[beam](columns.sine(k) - beam_sines[beam]) : 0.0;
          c.weights.push_back(static_cast<float>(squared ? w * w : w));
        }
    } else {
      c.panels.push_back({first, clipped_from, clipped_to - clipped_from, 4 * static_cast<std::size_t>(clipped_from - from)});
    }
  }
  return c;
}

}  // namespace sonar
