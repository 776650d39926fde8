// The device's tables of a plan, which follow from product, settings and seed, sent once and used by every ping that
// has them (core/pipeline/ping_plan.hpp).
#pragma once

#include <cstdint>
#include <memory>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "cuda/arena.hpp"

namespace sonar::cuda {

class PlanTables {
 public:
  /// Queues the tables on `lane`. They are valid as long as this.
  PlanTables(Machine& machine, int lane, const PingRequest& request);

  bool serves(const PingRequest& request) const;
  PingPlan& plan() { return plan_; }
  const PingPlan& plan() const { return plan_; }
  /// Noise, or what has the pulse's correlation: drawn when a ping first needs it. Queues the tables on `lane`.
  void need_noise(int lane);
  /// The part of a ping's view that is the plan's.
  void fill(PingView& view) const;

 private:
  void add_spectrum(const SpectralColumns& spectral);

  std::shared_ptr<const SonarModel> model_;
  Seed seed_;
  PingPlan plan_;
  NoiseTable noise_, grains_;
  Arena memory_, noise_memory_;
  PingView view_{};
};

}  // namespace sonar::cuda
