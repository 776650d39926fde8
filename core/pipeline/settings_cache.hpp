// Tables of settings that are kept from ping to ping, because several sonars alternate and clients return to earlier settings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// The tables of one model with one set of settings.
struct PreparedSettings {
  std::shared_ptr<const SonarModel> model;
  PingPlan plan;
  NoiseTable noise, grains;  // noise of the receiver; noise with the pulse's correlation, if that is different
  std::uint64_t last_used = 0;

  bool one_table() const { return plan.noise_filter == plan.pulse_filter; }
};

class SettingsCache {
 public:
  /// Largest size of all tables. It is enough for about eight of the largest (M1200d with 512 beams) or for hundreds of small
  /// ones.
  static constexpr std::size_t usual_bytes = std::size_t{64} << 20;
  explicit SettingsCache(std::size_t most_bytes = usual_bytes) : most_bytes_(most_bytes) {}

  /// Returns the tables of a request, and makes them if needed. If the tables become too large, those that have been unused for
  /// longest are dropped. The result is valid until the next call.
  PreparedSettings& prepared_for(const PingRequest& request, const Scene& scene, Parallel& pool);
  /// Approximate size of all tables.
  std::size_t bytes() const;
  std::size_t count() const { return prepared_.size(); }

 private:
  void forget_others(const PreparedSettings& in_use);

  std::size_t most_bytes_;
  std::vector<std::unique_ptr<PreparedSettings>> prepared_;
  std::uint64_t uses_ = 0;
};

}  // namespace sonar
