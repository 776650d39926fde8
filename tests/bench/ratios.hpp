// Ratios of the hot loops to the plain ways of doing the same (specs: P6): both sides in one process, one thread, in turns, so
// that they hold on a noisy machine. Best of several runs each.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "tests/bench/measure.hpp"

namespace sonar::bench {

/// Least time of this thread in so many runs of `work`.
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
  double least = 0;           // what must hold; 0 = none
  double share_measured = 1;  // share of the slow side that was measured; its time is scaled up
  double difference = 0;      // relative, in the least squares, of the two results where they mean the same; 0 = not compared
  double ratio() const { return fast_ms > 0 ? slow_ms / fast_ms : 0; }
  bool holds() const { return ratio() >= least; }
};

/// Over the case P1: its 512 beams, 300 echoes a beam, 394 rows.
std::vector<Ratio> measure_sums(const BenchOptions& options);
std::vector<Ratio> measure_beam_weights(const BenchOptions& options);
/// Rays of P1 over the scene, packets and single; detection of its picture.
std::vector<Ratio> measure_rays(std::shared_ptr<const Scene> scene, const BenchScene& where, const BenchOptions& options);
std::vector<Ratio> measure_detection(const BenchOptions& options);

void print(const Ratio& ratio);
nlohmann::json json_of(const Ratio& ratio);

}  // namespace sonar::bench
