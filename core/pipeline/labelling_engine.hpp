// The CPU's engine with labels beside its pings: for data sets, which are made offline.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/pipeline/labels.hpp"
#include "core/pipeline/ping_engine.hpp"

namespace sonar {

/// Why the samples of such pings have no labels; empty = they have.
std::string why_unlabelled(const PingRequest& request, const Scene& scene);
/// Those of a ping that hears nothing.
PingLabels no_labels(const PingRequest& request, const Scene& scene);

class LabellingEngine final : public PingEngine {
 public:
  /// The pool must outlive it.
  LabellingEngine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options = {});
  ~LabellingEngine() override;

  /// The same pings as those of make_cpu_engine(). Beyond what that refuses: the fixed fan, whose rays belong to no cell, and
  /// scenes of more instances than labels have numbers.
  std::vector<Ping> run(std::span<const PingRequest> requests) override;
  std::string description() const override;
  PingStatistics statistics() const override;
  std::vector<PingStatistics> statistics_of_each() const override;
  /// Of every ping of the last run().
  const std::vector<PingLabels>& labels() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sonar
