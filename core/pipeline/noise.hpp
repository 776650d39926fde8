// Receiver noise: white complex Gaussian noise for each column, shaped in range like the pulse. It is added before beamforming,
// so that neighbouring beams share noise as in a real array (docs/acoustics.md, section 5). It is read from a filtered table at
// hashed positions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/base/units.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

class NoiseTable {
 public:
  /// Makes a new table if the seed or the filter has changed. If one of `others` has a table with the same seed and filter,
  /// that table is shared instead. E|n|^2 = 1 per sample.
  void prepare(Seed seed, const std::vector<float>& filter, std::span<const NoiseTable* const> others = {});
  /// column[2 n], column[2 n + 1] += rms * noise for n in [0, samples). It depends only on (seed, sonar, ping, column, n).
  void add(std::uint32_t sonar, std::uint32_t ping, int column_index, float rms, int samples, float* column) const;
  /// Like add(), but replaces the values of the column with the noise.
  void set(std::uint32_t sonar, std::uint32_t ping, int column_index, float rms, int samples, float* column) const;
  /// The table that add() reads: noise_table_samples complex values (core/pipeline/arithmetic/noise_place.hpp).
  const std::vector<float>& shaped() const { return *shaped_; }
  /// Size of the table in memory. Memory in `counted`, which other tables share, does not count; the function adds its own
  /// memory to `counted`.
  std::size_t bytes(std::set<const void*>& counted) const;

 private:
  template <class Put>
  void read(std::uint32_t sonar, std::uint32_t ping, int column_index, float rms, int samples, float* column, Put put) const;

  Seed seed_{};
  std::vector<float> filter_;
  std::shared_ptr<const std::vector<float>> white_, shaped_ = std::make_shared<std::vector<float>>();  // complex, interleaved
};

/// The noise of one ping of one sonar. A null `table` means no noise.
struct PingNoise {
  const NoiseTable* table = nullptr;
  std::uint32_t sonar = 0, ping = 0;
};

// Signals that receive channels share, with opposite signs in neighbouring channels: noise, and in some receivers the
// transmitter's leak. In pictures of an array that is focused at every range, these signals appear as wide grains and fringes
// (docs/acoustics.md, section 5).

/// The reason why the numbers of channels and of channels in a group are invalid; empty if they are valid.
std::string why_impossible(const SharedNoise& law);
/// The reason if SharedNoiseTable would need too much memory or time; else empty. The numbers of channels must be valid.
std::string why_table_too_large(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches);

}  // namespace sonar
