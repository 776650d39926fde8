// The steps of a ping: the number of indices of each step, and its body. Both the CUDA module and the host loops call run_step
// for every index below step_size. The steps run one after the other, in the order of Step.
#pragma once

#include "cuda/beam_steps.hpp"
#include "cuda/cell_steps.hpp"
#include "cuda/column_steps.hpp"
#include "cuda/fan_steps.hpp"
#include "cuda/spectral_steps.hpp"

namespace sonar::cuda {

/// Clears the counters of the other steps.
SONAR_HD inline void clear(const PingView& p, std::uint32_t i) {
  if (i < counters_a_ping) p.counters[i] = 0;
  if (i < p.chunks * static_cast<std::uint32_t>(p.sea.columns)) p.in_chunk[i] = 0;
}

/// Number of indices of a step for this ping; 0 = the step is not needed.
SONAR_HD inline std::uint32_t step_size(Step step, const PingView& p) {
  const auto columns = static_cast<std::uint32_t>(p.sea.columns), elevations = static_cast<std::uint32_t>(p.sea.elevations);
  const auto samples = static_cast<std::uint32_t>(p.samples), beams = static_cast<std::uint32_t>(p.beams);
  switch (step) {
    case Step::clear:
      return p.chunks * columns > counters_a_ping ? p.chunks * columns : counters_a_ping;
    case Step::trace_base:
      return p.has_scene != 0 ? columns * elevations : 0;
    case Step::refine:
      return p.has_scene != 0 ? columns * (elevations - 1) : 0;
    case Step::first_hits:
      return p.first_hits != nullptr ? columns : 0;
    case Step::scatter:
    case Step::rank:
    case Step::place:
      return p.slots;
    case Step::scan_chunks:
    case Step::scan_columns:
      return p.slots > 0 ? columns : 0;
    case Step::sum_columns:
      return p.spectral.grids == nullptr ? columns * sum_parts : 0;
    case Step::spread:
      return p.spectral.grids != nullptr ? columns * spread_parts : 0;
    case Step::fold:
      return p.spectral.grids != nullptr ? columns * static_cast<std::uint32_t>(p.spectral.period) : 0;
    case Step::unfold:
      return p.spectral.grids != nullptr ? columns * samples : 0;
    case Step::multipath:
      return p.multipath != nullptr ? columns * samples : 0;
    case Step::volume:
      return p.slices != nullptr ? columns : 0;
    case Step::finish_columns:
      return columns * samples;
    case Step::point_weights:
      return static_cast<std::uint32_t>(p.point_count + p.pulse_count) * beams;
    case Step::form_beams:
      return (beams + panels_at_once * beams_a_panel - 1) / (panels_at_once * beams_a_panel) * samples;
    case Step::refocus:
    case Step::blend:
      return p.mixed != nullptr ? beams * samples : 0;
    case Step::crosstalk_sum:
      return p.crosstalk != nullptr ? samples : 0;
    case Step::crosstalk_add:
      return p.crosstalk != nullptr ? beams * samples : 0;
    case Step::receive:
      return static_cast<std::uint32_t>(p.rows) * beams;
    case Step::steps:
      break;
  }
  return 0;
}

/// Runs the body of a step, which is selected at compile time, so that each kernel contains only one body.
template <Step step>
SONAR_HD inline void run_step(const PingView& p, std::uint32_t i) {
  if constexpr (step == Step::clear) clear(p, i);
  if constexpr (step == Step::trace_base) trace_base(p, i);
  if constexpr (step == Step::refine) refine(p, i);
  if constexpr (step == Step::first_hits) first_hits(p, i);
  if constexpr (step == Step::scatter) scatter(p, i);
  if constexpr (step == Step::rank) rank(p, i);
  if constexpr (step == Step::scan_chunks) scan_chunks(p, i);
  if constexpr (step == Step::scan_columns) scan_columns(p, i);
  if constexpr (step == Step::place) place(p, i);
  if constexpr (step == Step::sum_columns) sum_columns(p, i);
  if constexpr (step == Step::spread) spread(p, i);
  if constexpr (step == Step::fold) fold(p, i);
  if constexpr (step == Step::unfold) unfold(p, i);
  if constexpr (step == Step::multipath) add_multipath(p, i);
  if constexpr (step == Step::volume) volume(p, i);
  if constexpr (step == Step::finish_columns) finish_columns(p, i);
  if constexpr (step == Step::point_weights) point_weights(p, i);
  if constexpr (step == Step::form_beams) form_beams(p, i);
  if constexpr (step == Step::refocus) refocus(p, i);
  if constexpr (step == Step::blend) blend(p, i);
  if constexpr (step == Step::crosstalk_sum) crosstalk_sum(p, i);
  if constexpr (step == Step::crosstalk_add) crosstalk_add(p, i);
  if constexpr (step == Step::receive) receive(p, i);
}

}  // namespace sonar::cuda
