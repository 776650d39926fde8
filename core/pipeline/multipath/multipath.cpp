#include "core/pipeline/multipath/multipath.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/multipath/multipath_scatter.hpp"

namespace sonar {
namespace {

/// The values of a point target for one path.
struct PointArrival {
  double range_m = 0, sine = 0, transmit = 0, sample_shift = 0;
  std::complex<double> carried;  // pressure per source, includes the phase of the carrier
};

class PointMultipath {
 public:
  PointMultipath(const PingContext& context, const FlatFaces& faces, const ImagePaths& image_paths)
      : scene_(context.rays),
        faces_(faces),
        image_paths_(image_paths),
        plan_(context.plan),
        s_(context.scalars),
        pattern_(plan_.mode.pattern) {
    // Uses all pairs of mirrors, not only those in the sampled map, because each path of a point is traced.
    const int n = static_cast<int>(image_paths.mirrors.size());
    paths_.push_back(path_by(image_paths.mirrors, -1));
    for (int a = 0; a < n; ++a) paths_.push_back(path_by(image_paths.mirrors, a));
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b)
        if (a != b) paths_.push_back(path_by(image_paths.mirrors, a, b));
  }

  /// Eq. 10 for a point: all pairs of arrivals, one out and one back, except for the direct pair.
  void add(Vec3d place, double strength_m, std::vector<PointEcho>& points) const {
    // The arrivals are in the order of the paths. [0] is the straight path if it arrives.
    std::vector<PointArrival> arrivals;
    bool direct = false;
    for (const Path& path : paths_) {
      const std::optional<PointArrival> arrival = arrive(path, place);
      if (!arrival) continue;
      direct = direct || path.first < 0;
      arrivals.push_back(*arrival);
    }
    for (std::size_t i = 0; i < arrivals.size(); ++i)
      for (std::size_t j = 0; j < arrivals.size(); ++j) {
        // scatter_points() adds the echo of the direct pair.
        if (direct && i == 0 && j == 0) continue;
        const PointArrival &out = arrivals[i], &back = arrivals[j];
        // Eq. 10: the echo is shown at the range (r_i + r_j) / 2 [m] and the bearing of the path back.
        const double sample = s_.sample_of(0.5 * (out.range_m + back.range_m)) + 0.5 * (out.sample_shift + back.sample_shift);
        if (sample <= -plan_.taps / 2 || sample >= plan_.samples + plan_.taps / 2 - 1) continue;
        points.push_back({back.sine, sample, s_.source_upa * strength_m * out.transmit * out.carried * back.carried});
      }
  }

 private:
  std::optional<PointArrival> arrive(const Path& path, Vec3d place) const {
    if (!is_lit(path, image_paths_.mirrors, place)) return {};
    // The path leaves in the direction of the image. Therefore eq. 29 applies to the image.
    const Vec3d image = path.image_of(place);
    const Vec3d p = s_.echo_geometry(image).from_sonar_m;
    const double r = length(p);
    if (r < nearest_scatterer_m || r + length(place) > 2 * s_.max_range_m || image.x <= 0) return {};
    const ConicalDirection direction = plan_.direction_of(p);
    const std::optional<std::size_t> column = plan_.column_of(direction, image_paths_.map.fan.half_angle_rad);
    if (!column) return {};
    // This test comes last, because it takes the most time.
    if (!reaches(scene_, s_, faces_, image_paths_.mirrors, path, place)) return {};
    // m / r D(psi) e^{-a r}, and the carrier phase of one way, -2 pi (f / c) r.
    const double size = reflectance_of(path, image_paths_.mirrors, (1 / r) * p) * std::exp(-s_.absorption_np_per_m * r) / r *
                        static_cast<double>(pattern_(static_cast<float>(std::pow(std::sin(direction.psi_rad), 2))));
    return PointArrival{r, direction.u, static_cast<double>(plan_.columns.transmit[*column]), s_.doppler_samples(p),
                        size * std::polar(1.0, -2 * pi * fraction_of_turn(0.5 * r * s_.turns_per_m))};
  }

  const RayScene& scene_;
  const FlatFaces& faces_;
  const ImagePaths& image_paths_;
  const PingPlan& plan_;
  const PingScalars& s_;
  OneWayPattern pattern_;
  std::vector<Path> paths_;
};

}  // namespace

void multipath_of_points(const PingContext& context, const FlatFaces& faces, const ImagePaths& image_paths,
                         std::vector<PointEcho>& points) {
  const Scene& scene = context.scene();
  if (scene.point_targets.empty()) return;
  const PointMultipath arrivals(context, faces, image_paths);
  const Pose world_in_sonar = inverse(context.scalars.seen_from);
  for (const PointTarget& target : scene.point_targets) {
    const Vec3d in_world = scene.in_world(target, context.bodies_in_world);
    arrivals.add(transform(world_in_sonar, in_world), amplitude_from_db(static_cast<double>(target.target_strength_db)), points);
  }
}

namespace {

// A batch is the work of one task. A round limits the memory for echoes. The sums depend on neither size.
constexpr std::size_t tiles_a_batch = 16;
constexpr std::size_t batches_a_round = 64;  // echoes of one round are stored and then summed

std::vector<Path> paths_in_view(const std::vector<FlatMirror>& mirrors, const BounceMap& map) {
  // The direct path, and the paths via one or two different mirrors that the traced map contains.
  std::vector<Path> paths{path_by(mirrors, -1)};
  const int n = static_cast<int>(mirrors.size());
  for (int a = 0; a < n; ++a)
    for (int b = -1; b < n; ++b)
      if (const Path path = path_by(mirrors, a, b); a != b && !map.owns_nothing(path)) paths.push_back(path);
  return paths;
}

/// Selects the cells that a path via mirrors may reach. Their sizes follow the lengths of the paths. reach[0] belongs to the
/// straight path.
CellView view_of(const PingPlan& plan, const PingScalars& s, std::span<const Pose> bodies, const std::vector<PathReach>& reach) {
  CellView view;
  view.sonar_in_world = s.seen_from;
  view.bodies_in_world = bodies;
  view.min_range_m = static_cast<float>(s.min_range_m);
  view.max_range_m = static_cast<float>(s.max_range_m);
  view.levels = plan.levels;
  view.seen_between = [&reach](Vec3d from_sonar_m, double radius_m) {
    std::optional<DistanceSpan> all;
    const auto join = [&](const PathReach& r) {
      const std::optional<DistanceSpan> one = r.seen_between(from_sonar_m, radius_m);
      if (!one) return;
      if (!all) all = one;
      all->nearest_m = std::min(all->nearest_m, one->nearest_m);
      all->farthest_m = std::max(all->farthest_m, one->farthest_m);
    };
    // The range of lengths of all paths. The direct path counts only if another path also reaches the point.
    for (std::size_t l = 1; l < reach.size(); ++l) join(reach[l]);
    if (all) join(reach[0]);
    return all;
  };
  return view;
}

/// The work is divided into rounds. Batches of tiles become echoes, sorted by group of columns. Then the groups sum the echoes,
/// batch by batch. So each sum has the order of the tiles, whichever thread runs a task.
class Rounds {
 public:
  Rounds(MultipathWork& work, const PingPlan& plan, const simd::Kernels& kernels, Parallel& pool)
      : work_(work), plan_(plan), kernels_(kernels), pool_(pool) {
    groups_ = static_cast<std::size_t>((plan.columns.count + MultipathScatterer::group_columns - 1) /
                                       MultipathScatterer::group_columns);
    // The buffers are kept from ping to ping. They grow only once to the size that the scene needs.
    work.batches.resize(batches_a_round);
    for (auto& batch : work.batches) batch.resize(groups_);
    work.spectral.resize(groups_);
    if (!plan.spectral) return;
    for (std::size_t g = 0; g < groups_; ++g) plan.spectral->begin(first_column(g + 1) - first_column(g), work.spectral[g]);
  }

  std::size_t run(std::vector<MultipathScatterer>& scatterers, const std::vector<TileInView>& tiles) {
    std::size_t echoes = 0;
    for (std::size_t first = 0; first < tiles.size(); first += tiles_a_batch * batches_a_round) {
      const std::size_t here = std::min(tiles.size() - first, tiles_a_batch * batches_a_round);
      const std::size_t batches = (here + tiles_a_batch - 1) / tiles_a_batch;
      // Batches of tiles run in parallel. Each writes its own buffers, one for each group of columns.
      pool_.for_each(batches, [&](std::size_t b, int worker) {
        const std::size_t from = first + b * tiles_a_batch, to = std::min(from + tiles_a_batch, tiles.size());
        for (std::size_t t = from; t < to; ++t) scatterers[static_cast<std::size_t>(worker)].scatter(tiles[t], work_.batches[b]);
      });
      for (std::size_t b = 0; b < batches; ++b)
        for (const Echoes& e : work_.batches[b]) echoes += static_cast<std::size_t>(e.count);
      // Groups run in parallel. Each sums its buffers in the order of the batches.
      pool_.for_each(groups_, [&](std::size_t g, int) {
        for (std::size_t b = 0; b < batches; ++b) sum_pulses(work_.batches[b][g], g);
      });
    }
    if (plan_.spectral)
      pool_.for_each(groups_, [&](std::size_t g, int) {
        plan_.spectral->finish(first_column(g), first_column(g + 1), work_.spectral[g], work_.columns);
      });
    return echoes;
  }

 private:
  int first_column(std::size_t group) const {
    return std::min(static_cast<int>(group) * MultipathScatterer::group_columns, plan_.columns.count);
  }
  void sum_pulses(Echoes& echoes, std::size_t group) {
    if (plan_.spectral)
      plan_.spectral->add(echoes, first_column(group), work_.spectral[group]);
    else
      synthesize(echoes, plan_.pulse(), kernels_, work_.columns);
  }

  MultipathWork& work_;
  const PingPlan& plan_;
  const simd::Kernels& kernels_;
  Parallel& pool_;
  std::size_t groups_ = 0;
};

}  // namespace

MultipathCounts simulate_multipath(const PingContext& context, MultipathWork& work, std::vector<PointEcho>& points) {
  const PingPlan& plan = context.plan;
  const PingScalars& s = context.scalars;
  work.has_echoes = false;
  // The faces depend only on the scene. The set of mirrors among them depends on the ping.
  if (!work.faces_found) {
    work.faces = find_flat_faces(context.scene(), least_reflectance);
    work.faces_found = true;
  }
  ImagePaths& image_paths = work.image_paths;
  // Image method (docs/acoustics.md, section 3, eq. 10): finds mirrors, traces rays via them, then adds the echoes of all pairs
  // of paths.
  image_paths.bubbles = BubbleLayer(context.scene().sea_surface);
  image_paths.mirrors = mirrors_of(context, work.faces);
  MultipathCounts counts;
  if (image_paths.mirrors.empty()) return counts;
  counts.rays = trace_bounces(context, work.faces, image_paths.mirrors, image_paths.map);
  image_paths.paths = paths_in_view(image_paths.mirrors, image_paths.map);
  multipath_of_points(context, work.faces, image_paths, points);
  // No mirror is visible; only the straight path is left.
  if (image_paths.paths.size() == 1) return counts;

  std::vector<PathReach> reach;
  for (const Path& path : image_paths.paths) reach.emplace_back(path, image_paths, plan, s);
  const CellView view = view_of(plan, s, context.bodies_in_world, reach);
  const std::vector<TileInView>& tiles = context.cells.in_view(view, context.pool);
  // gamma of eq. 21. It is needed only in expected power, for the cross term of a pair ij, ji.
  const std::vector<float> correlation = plan.expected_power ? beam_correlation_over_columns(plan) : std::vector<float>{};
  // Each worker has its own scatterer, because the scatterer stores the arrivals of its current cell.
  std::vector<MultipathScatterer> scatterers;
  for (int worker = 0; worker < context.pool.threads(); ++worker)
    scatterers.emplace_back(context, image_paths, reach, correlation);
  // The echoes are in separate columns. add_multipath() adds these before the transmitter's pattern is applied.
  work.columns.shape(plan.columns.count, plan.samples, plan.taps);
  clear_columns(work.columns, 0, plan.columns.count);
  counts.echoes = Rounds(work, plan, context.kernels, context.pool).run(scatterers, tiles);
  work.has_echoes = counts.echoes > 0;
  return counts;
}

void add_multipath(const MultipathWork& work, int first, int last, ColumnSignals& signals) {
  if (!work.has_echoes) return;
  const std::ptrdiff_t from = first * signals.stride, to = last * signals.stride;
  for (std::ptrdiff_t i = from; i < to; ++i)
    signals.data[static_cast<std::size_t>(i)] += work.columns.data[static_cast<std::size_t>(i)];
}

}  // namespace sonar
