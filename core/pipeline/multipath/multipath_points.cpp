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

}  // namespace sonar
