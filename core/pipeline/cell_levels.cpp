#include <cmath>
#include <vector>

#include "core/pipeline/ping_plan.hpp"

namespace sonar {

std::vector<CellLevel> make_cell_levels(double pulse_width_m, double beam_width_rad, double max_range_m) {
  const int coarsest = static_cast<int>(std::ceil(-std::log2(pulse_width_m) - 1e-9));
  constexpr double level_fade = 1.15;  // levels cross-fade over 15 % of the range
  constexpr double nearest_m = 0.2;    // no image begins at a shorter range; all nearer cells have the same level
  std::vector<CellLevel> levels;
  double coarser_begins = 2 * max_range_m;  // range at which the next coarser level begins
  for (int level = coarsest;; ++level) {
    // From this range on, a cell is at most a third of a beam wide: 2^-level <= r theta / 3.
    const double begins = 3 * std::ldexp(1.0, -level) / beam_width_rad;
    const bool finest = begins < nearest_m || level - coarsest > 10;
    CellLevel l;
    l.level = level;
    l.fade_in_from_m = finest ? 0.0f : static_cast<float>(begins);
    l.full_from_m = finest ? 0.0f : static_cast<float>(begins * level_fade);
    l.full_to_m = static_cast<float>(coarser_begins);
    l.fade_out_to_m = static_cast<float>(coarser_begins * level_fade);
    if (begins < max_range_m || finest) levels.push_back(l);
    if (finest) break;
    if (begins < max_range_m) coarser_begins = begins;
  }
  return levels;
}

}  // namespace sonar
