#include "cuda/take_results.hpp"

#include <complex>
#include <cstring>

#include "core/pipeline/truth.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

/// The row of the benchmark's table for a step.
constexpr Stage stage_of(Step step) {
  if (step <= Step::first_hits) return Stage::trace;
  if (step <= Step::place) return Stage::scatter;
  if (step <= Step::unfold) return Stage::synthesize;
  if (step <= Step::finish_columns) return Stage::noise;
  return step == Step::receive ? Stage::receive : Stage::form_beams;
}

}  // namespace

void share_times(const StepSeconds& seconds, BatchRoom& room) {
  const auto pings = static_cast<double>(room.pings.size());
  for (BatchRoom::Ping& ping : room.pings) {
    ping.statistics.seconds[static_cast<std::size_t>(Stage::synthesize)] += seconds.transforms / pings;
    for (int step = 0; step < step_count; ++step)
      ping.statistics.seconds[static_cast<std::size_t>(stage_of(static_cast<Step>(step)))] += seconds.of[step] / pings;
  }
}

void take_results(BatchRoom::Ping& from, const PingView& view) {
  Ping& ping = from.wanted->ping = std::move(from.ping);
  const auto copy = [](void* to, const void* host, std::size_t bytes) {
    if (bytes > 0) std::memcpy(to, host, bytes);
  };
  copy(ping.samples.data(), from.codes.host, ping.samples.size());
  copy(ping.pressure_upa.data(), from.pressure.host, ping.pressure_upa.size() * sizeof(float));
  copy(ping.beam_signal_upa.data(), from.beams.host, ping.beam_signal_upa.size() * sizeof(std::complex<float>));
  if (ping.request.switches.keep_truth) {
    std::vector<BeamTruth> by_column(static_cast<std::size_t>(view.sea.columns));
    if (view.first_hits)
      for (std::size_t k = 0; k < by_column.size(); ++k)
        if (from.truth.host[k].object != no_object) by_column[k] = {from.truth.host[k].range_m, from.truth.host[k].object};
    ping.truth = truth_of_beams(from.plan->plan(), by_column);
  }
  // Rays and echoes are counted on the device. The number of base rays is known in advance.
  if (view.has_scene != 0) {
    const SeaView& sea = view.sea;
    // A ray of the side lobes serves several columns.
    const int sides = 2 * sea.side_elevations, shared = (sea.columns + sea.side_columns - 1) / sea.side_columns;
    from.statistics.rays +=
        from.counters.host[0] + static_cast<std::size_t>(sea.columns * (sea.elevations - sides) + shared * sides);
    from.statistics.echoes += from.counters.host[1];
  }
  from.wanted->statistics = from.statistics;
  from.wanted->state = WantedPing::State::done;
}

}  // namespace sonar::cuda
