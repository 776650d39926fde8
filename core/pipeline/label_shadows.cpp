// Shadows in LabelWork: the gaps that rays found in a column, and the parts of gaps without echoes.
#include <algorithm>
#include <cmath>

#include "core/pipeline/labels.hpp"

namespace sonar {
namespace {

/// The samples of a column with a hit, from bottom to top.
using Upwards = std::vector<const FanScratch::Sample*>;

/// A straight line, 1 / x over the tangent, that approximates the surface hidden by the object at sample `of`. It connects the
/// last sample below the object with the first one above it on the same surface. If there is none above, the line through the
/// lowest samples is continued. If there is no line, low and high are equal.
struct HiddenLine {
  std::size_t low = 0, high = 0;
  float tangent = 0, inverse_x = 0, slope = 0;

  HiddenLine(const Upwards& up, std::size_t of) {
    const auto last_below = [&](std::uint32_t object) {
      for (std::size_t i = of; i-- > 0;)
        if (up[i]->surface.object == object) return i;
      return up.size();
    };
    for (std::size_t j = of + 1; j < up.size(); ++j) {
      const std::uint32_t object = up[j]->surface.object;
      if (object == up[of]->surface.object) continue;
      if (const std::size_t i = last_below(object); i < up.size()) {
        draw(up, i, i, j);
        high = j;
        return;
      }
    }
    if (const std::size_t i = last_below(up.front()->surface.object); i > 0 && i < up.size()) {
      draw(up, i, 0, i);
      high = slope < 0 ? up.size() : low;
    }
  }
  /// Range at which the line crosses the direction of a sample; infinite beyond the horizon.
  float range_m(const FanScratch::Sample& s) const {
    const float inverse = inverse_x + slope * (s.tangent - tangent);
    return inverse > 0 ? 1 / (inverse * s.forward) : HUGE_VALF;
  }

 private:
  void draw(const Upwards& up, std::size_t from, std::size_t a, std::size_t b) {
    low = from;
    tangent = up[low]->tangent, inverse_x = up[low]->surface.inverse_x;
    slope = (up[b]->surface.inverse_x - up[a]->surface.inverse_x) / (up[b]->tangent - up[a]->tangent);
  }
};

/// Calls f(from_m, to_m, object) for each part of the ranges from_m to to_m behind sample `of`. Each part lies in the shadow of
/// the nearest object that hides it. This is the object that is visible in the direction of the part.
template <class F>
void for_each_caster(const Upwards& up, std::size_t of, float from_m, float to_m, F f) {
  const HiddenLine line(up, of);
  const std::uint32_t object = up[of]->surface.object;
  for (std::size_t i = line.low + 1; i < line.high; ++i) {
    const std::uint32_t seen = up[i]->surface.object;
    if (seen == object || seen == up[line.low]->surface.object) continue;
    const float begin = std::max(from_m, line.range_m(*up[i]));
    const float end = std::min(to_m, i + 1 < up.size() ? line.range_m(*up[i + 1]) : HUGE_VALF);
    if (!(begin < end)) continue;
    if (begin > from_m) f(from_m, begin, object);
    f(begin, end, seen);
    from_m = end;
  }
  if (from_m < to_m) f(from_m, to_m, object);
}

}  // namespace

void LabelWork::note_shadows(const FanScratch& fan, int first, int last) {
  const PingPlan& plan = context_->plan;
  const auto elevations = static_cast<std::int32_t>(plan.fan.elevation_rad.size());
  const auto at = [&](std::int32_t i) -> const FanScratch::Sample& { return fan.samples[static_cast<std::size_t>(i)]; };
  const auto is_hit = [](const SurfaceHit& s) { return s.object != RayPacket::miss; };
  const auto sample_of = [&](float range_m) {
    return static_cast<float>(context_->scalars.sample_of(static_cast<double>(range_m)));
  };
  const auto end = static_cast<float>(plan.samples);
  struct Behind {
    std::uint32_t object;
    float from_m;  // range at which the shadow begins; 0: at the object
    bool goes_on;  // true if a surface lies beyond the shadow
  };
  std::vector<Behind> behind;
  Upwards up;
  for (int k = first; k < last; ++k) {
    std::vector<Gap>& gaps = gaps_[static_cast<std::size_t>(k)];
    const std::int32_t lowest = (k - first) * elevations;
    // Goes through the samples from bottom to top. An object hides surfaces beyond it. The hidden part begins where such a
    // surface is last visible, below the lower edge of the object. It ends where the surface is visible again, above the upper
    // edge. If the object stands on a surface, the hidden part begins at the object.
    behind.clear();
    up.clear();
    for (std::int32_t i = lowest; i >= 0; i = at(i).next)
      if (is_hit(at(i).surface)) up.push_back(&at(i));
    std::size_t hits = 0;
    const auto put = [&](float from_m, float to_m) {
      for_each_caster(up, hits - 1, from_m, to_m, [&](float from, float to, std::uint32_t object) {
        gaps.push_back({sample_of(from), std::isfinite(to) ? sample_of(to) : end, object});
      });
    };
    for (std::int32_t i = lowest, below = -1; i >= 0; below = i, i = at(i).next) {
      const SurfaceHit& a = at(i).surface;
      hits += is_hit(a) ? 1 : 0;
      const SurfaceHit under = below < 0 ? SurfaceHit{} : at(below).surface;
      if (is_hit(a) && under.object != a.object) {
        const bool is_first = std::none_of(behind.begin(), behind.end(), [&](const Behind& b) { return b.object == a.object; });
        const bool stands = is_hit(under) && under.range_m < a.range_m, hides = is_hit(under) && under.range_m > a.range_m;
        if (is_first) behind.push_back({a.object, 0, false});
        Behind& b = *std::find_if(behind.begin(), behind.end(), [&](const Behind& x) { return x.object == a.object; });
        if (hides)
          b.from_m = under.range_m, b.goes_on = true;
        else if (is_first)
          b.goes_on = stands;
      }
      const bool is_last = at(i).next < 0;
      if (!is_hit(a) || (!is_last && !at(i).edge_above)) continue;
      const SurfaceHit over = is_last ? SurfaceHit{} : at(at(i).next).surface;
      Behind& b = *std::find_if(behind.begin(), behind.end(), [&](const Behind& x) { return x.object == a.object; });
      if (is_hit(over) && over.range_m > a.range_m)
        put(std::max(a.range_m, b.from_m), over.range_m);
      else if (is_hit(over) && over.object == a.object)
        gaps.push_back({sample_of(over.range_m), sample_of(a.range_m), a.object});
      else if (!is_hit(over) && b.goes_on)
        put(std::max(a.range_m, b.from_m), HUGE_VALF);
    }
    std::stable_sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.from < b.from; });
  }
}

/// Marks rows in the column's gaps as dark if the column has no echo above the noise there. An echo in a gap can come from
/// another elevation, or from the length of a pulse.
void LabelWork::find_dark(int column) {
  const PingPlan& plan = context_->plan;
  const int rows = plan.settings.range_bin_count, per_row = plan.settings.samples_per_row;
  std::uint16_t* dark = dark_.data() + static_cast<std::ptrdiff_t>(column) * rows;
  const std::vector<Gap>& gaps = gaps_[static_cast<std::size_t>(column)];
  if (gaps.empty()) return;
  for (const Gap& gap : gaps) {
    const int from = std::max(row_of(static_cast<double>(gap.from), per_row), 0);
    const int to = std::min(row_of(static_cast<double>(gap.to), per_row), rows);
    for (int row = from; row < to; ++row)
      if (dark[row] == 0) dark[row] = static_cast<std::uint16_t>(gap.object + 1);
  }
  const auto noise = static_cast<float>(plan.column_noise_upa * plan.column_noise_upa);
  for (const Part& part : groups_[static_cast<std::size_t>(column / group_columns_)].of_this_ping()) {
    const int k = column - part.first_column;
    if (k < 0 || k >= part.columns) continue;
    const float* power = part.power.data() + static_cast<std::ptrdiff_t>(k) * part.rows;
    for (int row = part.first_row; row < std::min(part.first_row + part.rows, rows); ++row)
      if (power[row - part.first_row] > noise) dark[row] = 0;
  }
}

/// Half width of the main lobe at -3 dB, as a sine.
double LabelWork::half_width(std::size_t beam) const {
  const ReceivePattern& pattern = context_->plan.beam_pattern[beam];
  return pattern.unit ? 0 : 0.5 * width_factor(context_->plan.mode.pattern.azimuth_taper) / pattern.aperture_wavelengths;
}

void LabelWork::find_shadows(int beam, PingLabels& out) const {
  const PingPlan& plan = context_->plan;
  const auto j = static_cast<std::size_t>(beam);
  const double middle = (plan.columns.first_sine - plan.beam_sine[j]) / plan.columns.spacing;
  const double reach = half_width(j) / plan.columns.spacing;
  const auto column_at = [&](double k) { return static_cast<int>(std::clamp(std::round(k), 0.0, plan.columns.count - 1.0)); };
  const int first = column_at(middle - reach), last = column_at(middle + reach), nearest = column_at(middle);
  const auto dark = [&](int column, int row) {
    return dark_[static_cast<std::size_t>(column) * static_cast<std::size_t>(out.rows) + static_cast<std::size_t>(row)];
  };
  for (int row = 0; row < out.rows; ++row) {
    if (dark(nearest, row) == 0) continue;
    int column = first;
    while (column <= last && dark(column, row) != 0) ++column;
    if (column <= last) continue;
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(out.beams) + j;
    if (!from_points_.empty() && static_cast<double>(from_points_[at]) > noise_of(row, j)) continue;
    out.instance[at] = 0, out.share[at] = 0, out.caster[at] = dark(nearest, row);
  }
}

}  // namespace sonar
