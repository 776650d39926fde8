// The tables of a plan on the device (core/pipeline/ping_plan.hpp). They depend on product, settings and seed. They are sent
// once, and every ping with the same values uses them.
#pragma once

#include <memory>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "cuda/arena.hpp"

namespace sonar::cuda {

class PlanTables {
 public:
  /// Queues copies of the tables on `lane`. The tables are valid while this object lives.
  PlanTables(Machine& machine, int lane, const PingRequest& request);

  bool serves(const PingRequest& request) const;
  PingPlan& plan() { return plan_; }
  const PingPlan& plan() const { return plan_; }
  /// Makes the tables of noise when a ping first needs them, and queues their copies on `lane`.
  void need_noise(int lane);
  /// Sets the pointers and values of a ping's view that belong to the plan.
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
