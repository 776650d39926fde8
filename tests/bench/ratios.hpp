// Ratios of the times of plain implementations to those of the hot loops (P6). Both run in one process, on one thread, in turn,
// so that other load changes the ratio little. Each time is the best of several runs.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "tests/bench/measure.hpp"

namespace sonar::bench {

/// Returns the minimum time of this thread in several runs of `work`.
template <class Work>
double best_ms(int times, Work&& work) {
  double best = 1e9;
  for (int i = 0; i < times; ++i) {
    const double begin = this_thread_s();
    work();
    best = std::min(best, 1e3 * (this_thread_s() - begin));
  }
  return best;
}

struct Ratio {
  std::string name;  // "synthesis: complex exponentials / pulses in time"
  double slow_ms = 0, fast_ms = 0;
  double least = 0;           // required minimum; 0 = none
  double share_measured = 1;  // measured fraction of the slow implementation; its time is extrapolated
  double difference = 0;      // relative rms difference of both results, if they are comparable; 0 = not compared
  double ratio() const { return fast_ms > 0 ? slow_ms / fast_ms : 0; }
  bool holds() const { return ratio() >= least; }
};

/// Synthesis in case P1: 512 beams, 300 echoes per beam, 394 rows.
std::vector<Ratio> measure_sums(const BenchOptions& options);
std::vector<Ratio> measure_beam_weights(const BenchOptions& options);
/// Rays of P1 over the scene, in packets and single; detection of its picture.
std::vector<Ratio> measure_rays(std::shared_ptr<const Scene> scene, const BenchScene& where, const BenchOptions& options);
std::vector<Ratio> measure_detection(const BenchOptions& options);

void print(const Ratio& ratio);
nlohmann::json json_of(const Ratio& ratio);

}  // namespace sonar::bench
