#include "tests/core/pipeline/specular_worlds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/scene/shapes/primitives.hpp"

namespace sonar::test {

Material mirror(double reflection) {
  Material m;
  m.name = "mirror";
  m.lambert_db = -20;
  m.roughness_m = 0;  // no energy is left for scattering
  m.reflection = static_cast<float>(reflection);
  return m;
}

std::shared_ptr<const Scene> world_of(std::vector<Mirror> mirrors, bool as_meshes) {
  Scene scene;
  for (Mirror& m : mirrors) {
    const auto material = static_cast<std::uint16_t>(scene.materials.size());
    scene.materials.push_back(m.material);
    std::fill(m.mesh.material.begin(), m.mesh.material.end(), material);
    Object object;
    object.name = "mirror " + std::to_string(material);
    object.mesh = std::make_shared<const Mesh>(std::move(m.mesh));
    object.in_world = m.in_world;
    if (!as_meshes) object.primitive = m.primitive;
    scene.objects.push_back(std::move(object));
  }
  return std::make_shared<const Scene>(std::move(scene));
}

Mirror specular_sphere(double radius_m) {
  return {make_sphere(radius_m, segments_for(radius_m)), {.kind = Primitive::Kind::sphere, .radius_m = radius_m, .size_m = {}}};
}
Mirror specular_cylinder(double radius_m, double length_m) {
  return {make_cylinder(radius_m, length_m, segments_for(radius_m)),
          {.kind = Primitive::Kind::cylinder, .radius_m = radius_m, .size_m = {0, 0, length_m}}};
}
Mirror specular_plane(double length_x_m, double length_y_m) {
  return {make_plane(length_x_m, length_y_m), {.kind = Primitive::Kind::plane, .size_m = {length_x_m, length_y_m, 0}}};
}
Mirror specular_box(Vec3d size_m) { return {make_box(size_m), {.kind = Primitive::Kind::box, .size_m = size_m}}; }

Pose facing(double x_m, double tilt_rad) {
  return {{x_m, 0, 0}, quat_from_rpy({0, 0, tilt_rad}) * quat_from_rpy({0, -pi / 2, 0})};
}
Pose standing(double x_m, double tilt_rad) { return {{x_m, 0, 0}, quat_from_rpy({0, tilt_rad, 0})}; }

SpecularSounding::SpecularSounding(std::shared_ptr<const Scene> scene, const FrequencyMode& mode, const PingSettings& settings)
    : sounding_(std::move(scene), mode, settings) {
  sounding_.request.switches.specular = true;
  sounding_.ping();
  middle_azimuth_ = static_cast<double>(sounding_.last().beam_azimuth_rad[static_cast<std::size_t>(settings.beam_count / 2)]);
  turn(0);
}

void SpecularSounding::turn(double yaw_rad) { sounding_.ping_from({}, {0, 0, yaw_rad - middle_azimuth_}); }

double SpecularSounding::peak_upa(double range_m, double slack_m) {
  const int beam = sounding_.beams() / 2;
  const int from = std::max(1, static_cast<int>(sounding_.row_of_range(range_m - slack_m)));
  const int to = std::min(sounding_.rows() - 2, static_cast<int>(sounding_.row_of_range(range_m + slack_m)) + 1);
  int best = from;
  for (int n = from; n <= to; ++n)
    if (sounding_.pressure(n, beam) > sounding_.pressure(best, beam)) best = n;
  if (!(sounding_.pressure(best, beam) > 0)) return 0;
  const double before = sounding_.pressure(best - 1, beam), after = sounding_.pressure(best + 1, beam);
  if (!(before > 0 && after > 0)) return sounding_.pressure(best, beam);
  return log_parabola(before, sounding_.pressure(best, beam), after).height;
}

double SpecularSounding::strength_per_m(double range_m, double slack_m) {
  const reference::Medium m = sounding_.medium();
  return peak_upa(range_m, slack_m) / m.source_upa * std::exp(2 * m.absorption_np_per_m * range_m);
}

double SpecularSounding::wavelength_m() const {
  return sounding_.medium().sound_speed_mps / static_cast<double>(sounding_.mode().centre_hz);
}

double db(double amplitude) { return 20 * std::log10(std::max(amplitude, 1e-30)); }

double kirchhoff_per_m(double wavelength_m, int steps_u, int steps_v, const std::function<Patch(double, double)>& surface) {
  std::complex<double> sum;
  for (int i = 0; i < steps_u; ++i)
    for (int j = 0; j < steps_v; ++j) {
      const Patch p = surface((i + 0.5) / steps_u, (j + 0.5) / steps_v);
      const double r = length(p.place), toward = -dot(p.area, p.place) / r;
      if (toward > 0) sum += std::polar(toward / (r * r), -4 * pi / wavelength_m * r);
    }
  return std::abs(sum) / (wavelength_m * steps_u * steps_v);
}

}  // namespace sonar::test
