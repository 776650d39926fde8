#include "core/pipeline/labels.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/pipeline/ping_engine.hpp"
#include "core/sonar/range_image.hpp"

namespace sonar {

std::string why_unlabelled(const PingRequest& request, const Scene& scene) {
  if (request.switches.mode != Mode::canonical || request.switches.fixed_fan > 0)
    return "labels need the canonical model: its surface cells belong to objects; leave out the mode and the fixed fan";
  if (range_image_of(request) != nullptr)
    return "range images have no labels: they are made without surface cells; keep_truth records the hit of each column";
  if (scene.objects.size() + scene.point_targets.size() > PingLabels::most_instances)
    return "labels are numbers of 16 bits: the scene has more than 65535 objects and point targets";
  return why_invalid(request);
}

PingLabels no_labels(const PingRequest& request, const Scene& scene) {
  const PingSettings& s = request.settings;
  const auto size = static_cast<std::size_t>(s.range_bin_count) * static_cast<std::size_t>(s.beam_count);
  PingLabels labels{s.range_bin_count, s.beam_count, {}, {}, {}, {}};
  labels.instance.resize(size), labels.share.resize(size), labels.caster.resize(size);
  for (const Object& o : scene.objects) labels.visible.push_back(o.label.empty() ? -1.0f : 0.0f);
  labels.visible.resize(scene.objects.size() + scene.point_targets.size());
  return labels;
}

struct LabelWork::Point {
  std::size_t object = 0;
  int first_row = 0;
  std::vector<float> rows;   // mean of |pulse|^2 in each row [uPa^2]
  std::vector<float> beams;  // power pattern of each beam in the direction of the point
};

namespace {

/// Fraction of a beam's energy in its farthest side lobes, which are omitted. The share of a label has steps of 1/255.
constexpr double dropped_energy = 1e-3;

/// |p|^2 at whole samples from the peak, up to the sample where it becomes negligible.
std::vector<float> pulse_powers(const PingPlan& plan) {
  constexpr double least = 1e-6;
  const int reach = std::max(plan.taps / 2, 1);
  const auto power = [&](int n) { return std::norm(plan.pulse_shape.at(n * plan.sample_time_s)); };
  int half = reach;
  while (half > 0 && power(half) < least && power(-half) < least) --half;
  std::vector<float> powers;
  for (int n = -half; n <= half; ++n) powers.push_back(static_cast<float>(power(n)));
  return powers;
}

}  // namespace

int LabelWork::row_of(double sample, int per_row) { return static_cast<int>(std::floor((sample + 0.5) / per_row)); }

void LabelWork::begin(const PingContext& context, const std::vector<PreparedTile>& tiles,
                      const std::vector<std::vector<std::uint32_t>>& by_group, int group_columns) {
  context_ = &context, tiles_ = &tiles, by_group_ = &by_group, group_columns_ = group_columns;
  const PingPlan& plan = context.plan;
  keep_weights();
  pulse_ = pulse_powers(plan);
  gaps_.assign(static_cast<std::size_t>(plan.columns.count), {});
  const int map_columns = group_columns + 2 * context.scalars.columns_turned(plan);
  nothing_.assign(static_cast<std::size_t>(map_columns) * static_cast<std::size_t>(plan.fan.bins + 1), 0.0f);
  groups_.resize(by_group.size());
  for (Group& g : groups_) g.used = 0;
  find_noise();
}

/// The weights are kept, because their computation takes as long as a ping and they change only with the sonar and its beams.
void LabelWork::keep_weights() {
  const PingPlan& plan = context_->plan;
  std::vector<std::pair<Taper, double>> widths;
  for (const ReceivePattern& p : plan.beam_pattern) widths.emplace_back(plan.mode.pattern.azimuth_taper, p.aperture_wavelengths);
  if (beam_sine_ == plan.beam_sine && beam_widths_ == widths && first_sine_ == plan.columns.first_sine &&
      spacing_ == plan.columns.spacing)
    return;
  weights_ =
      make_beam_weights(plan.mode, plan.columns, plan.beam_sine, true, {.dropped_energy = dropped_energy, .transform = false});
  beam_sine_ = plan.beam_sine, beam_widths_ = std::move(widths);
  first_sine_ = plan.columns.first_sine, spacing_ = plan.columns.spacing;
}

/// Determines the level of the receiver's noise at a beam's output. Echoes must exceed this level, even if the noise is
/// switched off.
void LabelWork::find_noise() {
  const PingPlan& plan = context_->plan;
  noise_far_.assign(plan.beam_sine.size(), 0.0);
  noise_near_ = noise_far_;
  const double column = plan.column_noise_upa * plan.column_noise_upa;
  for (const BeamPanel& panel : weights_.panels)
    for (int i = 0; i < 4 * panel.count; ++i) {
      const auto beam = static_cast<std::size_t>(panel.first_beam + i % 4),
                 k = static_cast<std::size_t>(panel.first_column + i / 4);
      if (beam >= noise_far_.size()) continue;
      const double power = column * static_cast<double>(weights_.weights[panel.weights + static_cast<std::size_t>(i)]);
      const NoiseProfile& profile = plan.noise_profile;
      noise_far_[beam] += power * (profile.is_even() ? 1.0 : static_cast<double>(profile.far[k]));
      if (!profile.is_even()) noise_near_[beam] += power * static_cast<double>(profile.near_less_far[k]);
    }
}

double LabelWork::noise_of(int row, std::size_t beam) const {
  const auto& decay = context_->plan.noise_profile.decay;
  const auto sample = static_cast<std::size_t>(row) * static_cast<std::size_t>(context_->plan.settings.samples_per_row);
  double power = noise_far_[beam] + (sample < decay.size() ? static_cast<double>(decay[sample]) : 0.0) * noise_near_[beam];
  return power + context_->plan.shared_noise.noise_power(beam, sample);
}

void LabelWork::begin_group(const simd::GroupView& group) {
  const Scene& scene = context_->scene();
  const PingPlan& plan = context_->plan;
  const auto g = static_cast<std::size_t>(group.first_column / group_columns_);
  const std::vector<std::uint32_t>& wanted = (*by_group_)[g];
  Group& mine = groups_[g];
  std::vector<Part>& parts = mine.parts;
  std::vector<std::size_t>& part_of = mine.part_of;
  part_of.assign(scene.objects.size(), SIZE_MAX);
  const int beside = plan.taps / 2 + 1;
  // The box of ranges and columns that the tiles of each object can reach.
  const auto samples_of = [&](const PreparedTile& t) {
    const double radius = length(to_double(t.seen.tile->box_middle_m)) + length(to_double(t.seen.tile->box_half_m));
    const double middle = static_cast<double>(t.seen.range_m), shift = static_cast<double>(t.seen.sample_shift);
    const auto clip = [&](double s) { return static_cast<int>(std::clamp(s, -1.0 * beside, 1.0 * (plan.samples + beside))); };
    return std::pair{clip(std::floor(context_->scalars.sample_of(middle - radius) + shift) - 1),
                     clip(std::ceil(context_->scalars.sample_of(middle + radius) + shift) + 2)};
  };
  for (const std::uint32_t i : wanted) {
    const PreparedTile& tile = (*tiles_)[i];
    const auto object = static_cast<std::size_t>(tile.seen.tile->object);
    const auto [from, to] = samples_of(tile);
    const int first = std::max(tile.first_column, group.first_column), last = std::min(tile.last_column, group.last_column);
    if (from >= to || first >= last) continue;
    if (part_of[object] == SIZE_MAX) {
      part_of[object] = mine.used++;
      if (parts.size() < mine.used) parts.emplace_back(), mine.by_sample.emplace_back();
      Part& p = parts[mine.used - 1];
      p.object = object;
      p.first_column = first, p.columns = last - first;
      p.first_sample = from, p.last_sample = to;
      continue;
    }
    Part& p = parts[part_of[object]];
    const int end = std::max(p.first_column + p.columns, last);
    p.first_column = std::min(p.first_column, first);
    p.columns = end - p.first_column;
    p.first_sample = std::min(p.first_sample, from);
    p.last_sample = std::max(p.last_sample, to);
  }
  for (std::size_t i = 0; i < mine.used; ++i) {
    Part& p = parts[i];
    mine.by_sample[i].assign(static_cast<std::size_t>(p.columns) * static_cast<std::size_t>(p.last_sample - p.first_sample),
                             0.0f);
    const std::size_t counted = scene.objects[p.object].label.empty() ? 0 : static_cast<std::size_t>(p.columns);
    p.seen.assign(counted, 0.0);
    p.open.assign(counted, 0.0);
  }
}

void LabelWork::add_cells(const simd::GroupView& group, Echoes& echoes) {
  Group& mine = groups_[static_cast<std::size_t>(group.first_column / group_columns_)];
  const float* powers = group.expected_power ? echoes.re.data() : echoes.power.data();
  int from = 0;
  for (const Echoes::Run& run : echoes.runs) {
    const int first = std::exchange(from, run.end);
    const std::size_t which = mine.part_of[static_cast<std::size_t>((*tiles_)[run.tile].seen.tile->object)];
    if (which == SIZE_MAX) continue;
    Part& part = mine.parts[which];
    const int samples = part.last_sample - part.first_sample;
    for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(run.end); ++i) {
      const int column = echoes.column[i] - part.first_column;
      const float sample = echoes.sample[i] - static_cast<float>(part.first_sample), power = powers[i];
      const int n = static_cast<int>(sample);
      if (column < 0 || column >= part.columns || !(sample >= 0) || n + 1 >= samples) continue;
      if (!part.seen.empty()) part.seen[static_cast<std::size_t>(column)] += static_cast<double>(power);
      // Divides the power between the two nearest samples. The pulse is applied later to all echoes at once.
      float* place = mine.by_sample[which].data() + static_cast<std::ptrdiff_t>(column) * samples + n;
      const float later = power * (sample - static_cast<float>(n));
      place[0] += power - later;
      place[1] += later;
    }
  }
  echoes.runs.clear();
}

void LabelWork::finish_group(const simd::GroupView& group, Echoes& scratch) {
  const auto g = static_cast<std::size_t>(group.first_column / group_columns_);
  Group& mine = groups_[g];
  // Computes the expected power of the cells, with a depth map in which nothing hides them.
  simd::GroupView open = group;
  open.expected_power = true;
  open.inverse_depth = open.depth_slope = nothing_.data();
  for (const std::uint32_t i : (*by_group_)[g]) {
    const CellTile& tile = *(*tiles_)[i].seen.tile;
    const std::size_t which = mine.part_of[static_cast<std::size_t>(tile.object)];
    if (which == SIZE_MAX || mine.parts[which].open.empty()) continue;
    Part& part = mine.parts[which];
    if (scratch.capacity() < tile.count) scratch.reserve(tile.count);
    const int count = context_->kernels.scatter_tile((*tiles_)[i].seen, open, scratch.at(0));
    for (std::size_t e = 0; e < static_cast<std::size_t>(count); ++e) {
      const int column = scratch.column[e] - part.first_column;
      const float sample = scratch.sample[e] - static_cast<float>(part.first_sample);
      if (column < 0 || column >= part.columns || !(sample >= 0) ||
          static_cast<int>(sample) + 1 >= part.last_sample - part.first_sample)
        continue;
      part.open[static_cast<std::size_t>(column)] += static_cast<double>(scratch.re[e]);
    }
  }
  for (std::size_t i = 0; i < mine.used; ++i) spread(mine.parts[i], mine.by_sample[i]);
}

/// Eq. 8 in power: spreads the echoes over the pulse, computes the mean of each row, and applies the transmitter's pattern.
void LabelWork::spread(Part& part, const std::vector<float>& by_sample) const {
  const PingPlan& plan = context_->plan;
  const int per_row = plan.settings.samples_per_row, half = static_cast<int>(pulse_.size()) / 2;
  const int samples = part.last_sample - part.first_sample;
  const int first_row = std::max(row_of(part.first_sample - half, per_row), 0);
  const int last_row = std::min(row_of(part.last_sample + half, per_row) + 1, plan.settings.range_bin_count);
  part.first_row = first_row / window * window;
  part.rows = last_row > first_row ? (last_row - part.first_row + window - 1) / window * window : 0;
  part.power.assign(static_cast<std::size_t>(part.columns) * static_cast<std::size_t>(part.rows), 0.0f);
  if (part.rows == 0) return;
  std::vector<float> line(static_cast<std::size_t>(samples + 2 * half));
  for (int k = 0; k < part.columns; ++k) {
    const float* from = by_sample.data() + static_cast<std::ptrdiff_t>(k) * samples;
    std::fill(line.begin(), line.end(), 0.0f);
    for (std::size_t tap = 0; tap < pulse_.size(); ++tap) {
      float* __restrict to = line.data() + tap;
      const float weight = pulse_[tap];
      for (int n = 0; n < samples; ++n) to[n] += weight * from[n];
    }
    const float transmit = plan.columns.transmit[static_cast<std::size_t>(part.first_column + k)];
    const float factor = transmit * transmit / static_cast<float>(per_row);
    float* rows = part.power.data() + static_cast<std::ptrdiff_t>(k) * part.rows;
    const int first = part.first_sample - half;  // index in `line`
    for (int n = std::max(0, -first); n < static_cast<int>(line.size()); ++n) {
      const int row = (first + n) / per_row - part.first_row;
      if (row >= part.rows) break;
      if (row >= 0) rows[row] += factor * line[static_cast<std::size_t>(n)];
    }
  }
}

PingLabels LabelWork::finish(std::span<const PointEcho> points) {
  const Scene& scene = context_->scene();
  const PingPlan& plan = context_->plan;
  PingLabels out;
  out.rows = plan.settings.range_bin_count, out.beams = plan.settings.beam_count;
  const auto size = static_cast<std::size_t>(out.rows) * static_cast<std::size_t>(out.beams);
  out.instance.assign(size, 0);
  out.share.assign(size, 0);
  out.caster.assign(size, 0);
  out.visible.assign(scene.objects.size() + scene.point_targets.size(), -1.0f);

  from_points_.clear();
  std::vector<Point> placed;
  const int per_row = plan.settings.samples_per_row;
  for (const PointEcho& echo : points) {
    const int middle = static_cast<int>(std::floor(echo.sample)), from = std::max(middle - plan.taps / 2 + 1, 0);
    const int to = std::min(middle + plan.taps / 2 + 1, plan.samples);
    if (echo.instance == 0 || from >= to) continue;
    Point point{.object = echo.instance - 1, .first_row = from / per_row, .rows = {}, .beams = {}};
    point.rows.assign(static_cast<std::size_t>((to - 1) / per_row - point.first_row + 1), 0.0f);
    for (int n = from; n < to; ++n)
      point.rows[static_cast<std::size_t>(n / per_row - point.first_row)] +=
          static_cast<float>(std::norm(echo.amplitude * plan.pulse_shape.at(plan.sample_time_s * (n - echo.sample))) / per_row);
    // The side lobes are the same as for cells.
    const double reach = weights_.half_band * plan.columns.spacing;
    from_points_.resize(size);
    for (std::size_t j = 0; j < plan.beam_sine.size(); ++j) {
      const double off = echo.sine - plan.beam_sine[j];
      point.beams.push_back(std::abs(off) > reach ? 0.0f : static_cast<float>(std::pow(plan.beam_pattern[j](off), 2)));
      if (std::abs(off) > std::max(2 * half_width(j), plan.columns.spacing)) continue;
      for (std::size_t r = 0; r < point.rows.size() && point.first_row + static_cast<int>(r) < out.rows; ++r)
        from_points_[(static_cast<std::size_t>(point.first_row) + r) * plan.beam_sine.size() + j] +=
            point.rows[r] * point.beams.back();
    }
    placed.push_back(std::move(point));
  }
  context_->pool.for_each(static_cast<std::size_t>((out.rows + window - 1) / window),
                          [&](std::size_t w, int) { label_window(w, placed, out); });
  dark_.assign(static_cast<std::size_t>(plan.columns.count) * static_cast<std::size_t>(out.rows), 0);
  context_->pool.for_each(gaps_.size(), [&](std::size_t k, int) { find_dark(static_cast<int>(k)); });
  context_->pool.for_each(static_cast<std::size_t>(out.beams),
                          [&](std::size_t j, int) { find_shadows(static_cast<int>(j), out); });

  // The energies are added in the order of columns, so that the sums do not depend on groups.
  std::vector<double> seen(scene.objects.size(), 0.0), open(scene.objects.size(), 0.0);
  for (const Group& group : groups_)
    for (const Part& part : group.of_this_ping())
      for (std::size_t k = 0; k < part.open.size(); ++k) seen[part.object] += part.seen[k], open[part.object] += part.open[k];
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (!scene.objects[i].label.empty()) out.visible[i] = open[i] > 0 ? static_cast<float>(std::min(seen[i] / open[i], 1.0)) : 0;
  for (std::size_t i = 0; i < scene.point_targets.size(); ++i)
    out.visible[scene.objects.size() + i] =
        std::any_of(placed.begin(), placed.end(), [&](const Point& p) { return p.object == scene.objects.size() + i; }) ? 1.0f
                                                                                                                        : 0.0f;
  return out;
}

/// Computes eq. 9 in power for each object, and finds the object with the most energy.
void LabelWork::label_window(std::size_t window_index, std::span<const Point> points, PingLabels& out) const {
  const PingPlan& plan = context_->plan;
  const int first_row = static_cast<int>(window_index) * window, last_row = std::min(first_row + window, out.rows);
  const std::size_t beams = plan.beam_sine.size(), padded = (beams + 3) / 4 * 4;
  const auto at = [](std::size_t beam) { return beam * window; };
  std::vector<float> best(at(padded), 0.0f), total(at(padded), 0.0f), own(at(padded), 0.0f);
  std::vector<std::uint16_t> whose(at(padded), 0);

  struct Source {
    std::size_t object;
    const Part* part;
    const Point* point;
  };
  std::vector<Source> sources;
  for (const Group& group : groups_)
    for (const Part& p : group.of_this_ping())
      if (p.first_row <= first_row && first_row < p.first_row + p.rows) sources.push_back({p.object, &p, nullptr});
  for (const Point& p : points)
    if (p.first_row < last_row && p.first_row + static_cast<int>(p.rows.size()) > first_row)
      sources.push_back({p.object, nullptr, &p});
  std::stable_sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) { return a.object < b.object; });

  alignas(64) float four[4 * window];
  for (auto source = sources.begin(); source != sources.end();) {
    const std::size_t object = source->object;
    std::size_t low = padded, high = 0;  // beams that receive the object
    for (; source != sources.end() && source->object == object; ++source) {
      if (const Part* part = source->part) {
        const float* power = part->power.data() + (first_row - part->first_row);
        for (const BeamPanel& panel : weights_.panels) {
          const int from = std::max(panel.first_column, part->first_column);
          const int to = std::min(panel.first_column + panel.count, part->first_column + part->columns);
          if (from >= to) continue;
          const float* weights =
              weights_.weights.data() + panel.weights + 4 * static_cast<std::size_t>(from - panel.first_column);
          context_->kernels.form_beam_panel(power + static_cast<std::ptrdiff_t>(from - part->first_column) * part->rows,
                                            part->rows, weights, to - from, four, window);
          const auto beam = static_cast<std::size_t>(panel.first_beam);
          for (std::size_t i = 0; i < at(4); ++i) own[at(beam) + i] += four[i];
          low = std::min(low, beam), high = std::max(high, beam + 4);
        }
      } else {
        const Point& point = *source->point;
        for (std::size_t j = 0; j < beams; ++j)
          for (std::size_t r = 0; r < point.rows.size(); ++r) {
            const int row = point.first_row + static_cast<int>(r) - first_row;
            if (row >= 0 && row < window) own[at(j) + static_cast<std::size_t>(row)] += point.rows[r] * point.beams[j];
          }
        low = 0, high = padded;
      }
    }
    for (std::size_t i = at(low); i < at(std::max(low, high)); ++i) {
      total[i] += own[i];
      if (own[i] > best[i]) best[i] = own[i], whose[i] = static_cast<std::uint16_t>(object + 1);
      own[i] = 0;
    }
  }
  for (int row = first_row; row < last_row; ++row)
    for (std::size_t j = 0; j < beams; ++j) {
      const std::size_t i = at(j) + static_cast<std::size_t>(row - first_row);
      const double noise = noise_of(row, j);
      if (!(static_cast<double>(best[i]) > noise)) continue;
      const std::size_t to = static_cast<std::size_t>(row) * beams + j;
      out.instance[to] = whose[i];
      out.share[to] =
          static_cast<std::uint8_t>(std::lround(255 * static_cast<double>(best[i]) / (static_cast<double>(total[i]) + noise)));
    }
}

}  // namespace sonar
