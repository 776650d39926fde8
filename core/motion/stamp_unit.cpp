#include "core/motion/stamp_unit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sonar::motion {
namespace {

constexpr int in_seconds = 9, in_milliseconds = 6, in_microseconds = 3, in_nanoseconds = 0;

/// Median of the steps that rise; 0 if there are none.
double usual_step(const std::vector<double>& stamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) steps.push_back(stamps[i] - stamps[i - 1]);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Metres per unit of the stamps.
double speed_of(const FirstLines& lines) {
  double way_m = 0;
  for (std::size_t i = 1; i < lines.positions.size(); ++i) way_m += length(lines.positions[i] - lines.positions[i - 1]);
  const double time = lines.stamps.back() - lines.stamps.front();
  return time > 0 ? way_m / time : 0;
}

}  // namespace

int unit_by_steps(const FirstLines& lines, int usual) {
  const double step = usual_step(lines.stamps);
  if (step == 0) return usual;
  const double speed = speed_of(lines);
  if (usual == in_nanoseconds) {
    constexpr double least_step_ns = 5e5;  // 2000 lines a second
    constexpr double least_since_1970_ns = 1e17;
    if (step >= least_step_ns || lines.stamps.front() >= least_since_1970_ns) return usual;
    return step < 5 ? in_seconds : step < 1000 ? in_milliseconds : in_microseconds;
  }
  constexpr double longest_step_s = 4, longest_wait_s = 1e5, slowest_m_s = 0.005, fastest_m_s = 20;
  const auto moves = [&](double units_in_a_second) {
    return speed * units_in_a_second >= slowest_m_s && speed * units_in_a_second <= fastest_m_s;
  };
  constexpr std::size_t lines_of_a_log = 10;  // a file that was written by hand for a resting body has fewer lines
  const bool is_log = lines.stamps.size() >= lines_of_a_log;
  const bool waits = speed == 0 && !is_log && step < longest_wait_s;
  if (step <= longest_step_s || waits || speed >= slowest_m_s) return usual;
  const bool logs_rest = is_log && speed * 1e3 < slowest_m_s;
  if (step < 1000) return moves(1e3) || logs_rest ? in_milliseconds : usual;
  if (step < 5000) return moves(1e3) || speed == 0 ? in_milliseconds : in_microseconds;
  return step < 1e6 || (step < 1e7 && moves(1e6)) ? in_microseconds : in_nanoseconds;
}

}  // namespace sonar::motion
