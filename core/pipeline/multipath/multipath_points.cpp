#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/multipath/multipath_scatter.hpp"

namespace sonar {
namespace {

/// A point target by one way.
struct PointArrival {
  double range_m = 0, sine = 0, transmit = 0, sample_shift = 0;
  std::complex<double> carried;  // pressure per source, with the carrier's phase
};

class PointGhosts {
 public:
  PointGhosts(const RayScene& scene, const FlatFaces& faces, const Ways& ways, const PingPlan& plan, const PingScalars& scalars)
      : scene_(scene), faces_(faces), ways_(ways), plan_(plan), s_(scalars), pattern_(plan.mode.pattern) {
    // All pairs of mirrors, not only those that own a part of the sampled map: a point's ways are traced one by one.
    const int n = static_cast<int>(ways.mirrors.size());
    legs_.push_back(leg_by(ways.mirrors, -1));
    for (int a = 0; a < n; ++a) legs_.push_back(leg_by(ways.mirrors, a));
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b)
        if (a != b) legs_.push_back(leg_by(ways.mirrors, a, b));
  }

  void add(Vec3d place, double strength_m, std::vector<PointEcho>& points) const {
    std::vector<PointArrival> arrivals;
    bool direct = false;
    for (const Leg& leg : legs_) {
      const std::optional<PointArrival> arrival = arrive(leg, place);
      if (!arrival) continue;
      direct = direct || leg.first < 0;
      arrivals.push_back(*arrival);
    }
    for (std::size_t i = 0; i < arrivals.size(); ++i)
      for (std::size_t j = 0; j < arrivals.size(); ++j) {
        if (direct && i == 0 && j == 0) continue;
        const PointArrival &out = arrivals[i], &back = arrivals[j];
        const double sample = s_.sample_of(0.5 * (out.range_m + back.range_m)) + 0.5 * (out.sample_shift + back.sample_shift);
        if (sample <= -plan_.taps / 2 || sample >= plan_.samples + plan_.taps / 2 - 1) continue;
        points.push_back({back.sine, sample, s_.source_upa * strength_m * out.transmit * out.carried * back.carried});
      }
  }

 private:
  std::optional<PointArrival> arrive(const Leg& leg, Vec3d place) const {
    if (!is_lit(leg, ways_.mirrors, place)) return {};
    const Vec3d image = leg.image_of(place);
    const Vec3d p = s_.meet(image).from_sonar_m;
    const double r = length(p);
    if (r < nearest_scatterer_m || r + length(place) > 2 * s_.max_range_m || image.x <= 0) return {};
    const ConicalDirection direction = plan_.direction_of(p);
    const std::optional<std::size_t> column = plan_.column_of(direction, ways_.map.fan.half_angle_rad);
    if (!column) return {};
    if (!reaches(scene_, s_, faces_, ways_.mirrors, leg, place)) return {};
    const double size = reflectance_of(leg, ways_.mirrors, (1 / r) * p) * std::exp(-s_.absorption_np_per_m * r) / r *
                        static_cast<double>(pattern_(static_cast<float>(std::pow(std::sin(direction.psi_rad), 2))));
    return PointArrival{r, direction.u, static_cast<double>(plan_.columns.transmit[*column]), s_.doppler_samples(p),
                        size * std::polar(1.0, -2 * pi * fraction_of_turn(0.5 * r * s_.turns_per_m))};
  }

  const RayScene& scene_;
  const FlatFaces& faces_;
  const Ways& ways_;
  const PingPlan& plan_;
  const PingScalars& s_;
  OneWayPattern pattern_;
  std::vector<Leg> legs_;
};

}  // namespace

void ghosts_of_points(const RayScene& scene, std::span<const Pose> bodies, const FlatFaces& faces, const Ways& ways,
                      const PingPlan& plan, const PingScalars& s, std::vector<PointEcho>& points) {
  if (scene.scene().point_targets.empty()) return;
  const PointGhosts ghosts(scene, faces, ways, plan, s);
  const Pose world_in_sonar = inverse(s.seen_from);
  for (const PointTarget& target : scene.scene().point_targets) {
    const Vec3d in_world = scene.scene().in_world(target, bodies);
    ghosts.add(transform(world_in_sonar, in_world), amplitude_from_db(static_cast<double>(target.target_strength_db)), points);
  }
}

}  // namespace sonar
