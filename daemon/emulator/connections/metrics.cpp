#include "daemon/emulator/connections/metrics.hpp"

#include <algorithm>

namespace sonar {

void Histogram::add(double seconds) {
  seconds = std::max(seconds, 0.0);
  const auto bound = std::lower_bound(bounds_s.begin(), bounds_s.end(), seconds);
  ++counts_[static_cast<std::size_t>(bound - bounds_s.begin())];
  ++count_;
  sum_s_ += seconds;
}

// Assumes that durations are evenly spread within a bin.
double Histogram::quantile_s(double q) const {
  if (count_ == 0) return 0;
  const double rank = std::clamp(q, 0.0, 1.0) * static_cast<double>(count_);
  double below = 0, lower_s = 0;
  for (std::size_t i = 0; i < bounds_s.size(); ++i) {
    const auto here = static_cast<double>(counts_[i]);
    if (here > 0 && below + here >= rank) return lower_s + (bounds_s[i] - lower_s) * std::max(rank - below, 0.0) / here;
    below += here;
    lower_s = bounds_s[i];
  }
  return bounds_s.back();
}

}  // namespace sonar
