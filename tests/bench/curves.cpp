// Measures how the time of a ping grows with each of its parameters. One parameter of P1 or P3a changes at a time.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "core/scene/shapes/terrain.hpp"
#include "tests/bench/findings.hpp"

namespace sonar::bench {
namespace {

using nlohmann::json;

constexpr int pings_a_point = 12;

/// Median milliseconds of a ping, by wall and by processors.
json point(double x, const ScenePointer& scene, const BenchCase& c, const BenchScene& where, const BenchOptions& options) {
  Bench bench(scene, options.threads.back(), options);
  Pinger pinger(c, options);
  std::vector<double> wall, processors;
  for (int k = 0; k < pings_a_point + 2; ++k) {
    const double used = processor_s();
    const double ms = 1e3 * pinger.fire(*bench.engine, pinger.request(k, bench_pose(c, where, k / 40.0)));
    if (k < 2) continue;
    wall.push_back(ms);
    processors.push_back(1e3 * (processor_s() - used));
  }
  return {{"x", x}, {"median_ms", Times(wall).median}, {"processor_ms", Times(processors).median}};
}

json curve(const char* name, const std::string& of, json points) {
  std::printf("curve %-32s", (std::string(name) + ", " + of + ":").c_str());
  for (const json& p : points) std::printf("  %g: %.2f ms", p["x"].get<double>(), p["median_ms"].get<double>());
  std::printf("\n");
  std::fflush(stdout);
  return {{"name", name}, {"case", of}, {"points", std::move(points)}};
}

/// The bed of the scene again, as rough, on another grid.
ScenePointer bed_of(const Scene& scene, double spacing_m, double bed_z_m) {
  SeabedShape shape;
  shape.spacing_x_m = shape.spacing_y_m = spacing_m;
  shape.seed = 42;
  shape.relief_m = 0.08;
  shape.wavelength_m = 3;
  auto centred = mesh_from_grid(make_seabed(shape));
  auto made = std::make_shared<Scene>();
  made->name = "bed";
  made->materials = scene.materials;
  Mesh& mesh = centred->mesh;
  mesh.material.assign(mesh.triangles.size(), 0);
  made->objects.push_back({.name = "bed",
                           .mesh = std::make_shared<const Mesh>(std::move(mesh)),
                           .in_world = {centred->centre_m + Vec3d{15, 0, bed_z_m}, {}}});
  return made;
}

/// Measures a round of `count` sonars that take turns over one scene: its time divided by their number [ms].
json sonars(int count, const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  const BenchCase c = *find_case("P3a");
  Bench bench(scene, options.threads.back(), options);
  Pinger pinger(c, options);
  std::vector<double> wall;
  for (int k = 0; k < pings_a_point + 2; ++k) {
    const double begin = now_s();
    for (int s = 0; s < count; ++s) {
      Pose at = bench_pose(c, where, k / 40.0);
      at.position_m.y += 3.0 * (s - 0.5 * (count - 1));
      PingRequest request = pinger.request(k, at);
      request.sonar_id = static_cast<std::uint32_t>(s);
      pinger.fire(*bench.engine, request);
    }
    if (k >= 2) wall.push_back(1e3 * (now_s() - begin) / count);
  }
  return {{"x", count}, {"median_ms", Times(wall).median}};
}

}  // namespace

json find_rates_of_threads(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  json found = json::array();
  for (const char* name : {"P1", "P3a", "P3d"})
    for (const int threads : {1, 2, 4}) {
      const BenchCase c = *find_case(name);
      const Figures f = measure(c, where, *scene, *Bench(scene, threads, options).engine, threads, options);
      std::printf("P13  %-4s %d threads: %.1f pings/s\n", name, threads, f.pings_per_second());
      std::fflush(stdout);
      found.push_back(
          {{"case", name}, {"description", c.description}, {"threads", threads}, {"pings_per_second", f.pings_per_second()}});
    }
  return found;
}

json find_curves(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  json curves = json::array();
  json points = json::array();
  const auto finish = [&](const char* name, const char* of) {
    curves.push_back(curve(name, of, std::move(points)));
    points = json::array();
  };
  for (const int rays : {75, 150, 300, 600}) {
    BenchCase c = *find_case("P1");
    c.fixed_fan = rays;
    points.push_back(point(rays, scene, c, where, options));
  }
  finish("rays a column", "P1 with a fixed fan");
  for (const int rows : {200, 437, 720, 1440, 2880}) {
    BenchCase c = *find_case("P3a");
    c.settings.range_bin_count = rows;
    c.settings.range_bin_m = c.settings.range_m / rows;
    c.settings.pulse_width_m = static_cast<float>(0.9 * c.settings.range_bin_m);
    points.push_back(point(rows, scene, c, where, options));
  }
  finish("rows", "P3a, pulse 0.9 of a row");
  for (const int beams : {128, 256, 512, 1024}) {
    BenchCase c = *find_case("P3a");
    c.settings.beam_count = beams;
    points.push_back(point(beams, scene, c, where, options));
  }
  finish("beams", "P3a");
  for (const double spacing_m : {0.8, 0.4, 0.2, 0.1, 0.05}) {
    const ScenePointer bed = bed_of(*scene, spacing_m, where.bed_z_m);
    points.push_back(point(static_cast<double>(bed->triangle_count()), bed, *find_case("P1"), where, options));
  }
  finish("triangles", "P1 over a rough bed of 40 x 40 m");
  for (const int count : {1, 2, 4, 8}) points.push_back(sonars(count, scene, where, options));
  finish("sonars", "P3a, milliseconds a ping");
  return curves;
}

}  // namespace sonar::bench
