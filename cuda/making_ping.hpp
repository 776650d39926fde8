// Internal to prepare_ping.cpp and fill_view.cpp.
#pragma once

#include "cuda/prepare_ping.hpp"

namespace sonar::cuda {

/// A ping while its view is being filled.
struct PingPreparer::Making {
  const AskedPing& asked;
  BatchRoom& room;
  const PingPlan& plan;
  PingScalars scalars;
  std::span<const Pose> bodies;
  std::vector<LawTable> laws = {};
  std::vector<float> turned_away = {};
  CellView looks_at = {};
  const CellsInView* seen = nullptr;  // points into PingPreparer::found_
  PingView view{};
  BatchRoom::Ping ping{};
  bool fits = true;

  const PingRequest& request() const { return asked.wanted->request; }
  double& seconds(Stage s) { return ping.statistics.seconds[static_cast<std::size_t>(s)]; }
  std::size_t columns() const { return static_cast<std::size_t>(plan.columns.count); }
  std::size_t samples() const { return static_cast<std::size_t>(plan.samples); }
  std::size_t beams() const { return static_cast<std::size_t>(plan.settings.beam_count); }
};

}  // namespace sonar::cuda
