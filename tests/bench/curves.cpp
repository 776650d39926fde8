// Measures how the time of a ping grows with each of its parameters, on one thread. One parameter of P1 or P3a changes at a time.
#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include "core/scene/shapes/terrain.hpp"
#include "tests/bench/findings.hpp"

namespace sonar::bench {
namespace {

using nlohmann::json;

constexpr int pings_a_point = 16;

/// Pings of one point of a curve. The ping with the least processor time is the one that other programs disturbed least.
class Samples {
 public:
  /// `fire` runs `pings` pings; the first two calls warm up and are not counted.
  template <class Fire>
  void add(int pings, const PingEngine& engine, const Fire& fire) {
    Sample mean;
    const double used = processor_s(), begin = now_s();
    for (int k = 0; k < pings; ++k) {
      fire(k);
      for (std::size_t s = 0; s < stages; ++s) mean.stage_ms[s] += 1e3 * engine.statistics().seconds[s] / pings;
    }
    mean.wall_ms = 1e3 * (now_s() - begin) / pings;
    mean.processor_ms = 1e3 * (processor_s() - used) / pings;
    mean.last = engine.statistics();
    if (warm_up_ > 0)
      --warm_up_;
    else
      samples_.push_back(mean);
  }

  json point(double x) const {
    std::vector<double> wall, processors;
    for (const Sample& s : samples_) wall.push_back(s.wall_ms), processors.push_back(s.processor_ms);
    const Sample& best = *std::min_element(samples_.begin(), samples_.end(),
                                           [](const Sample& a, const Sample& b) { return a.processor_ms < b.processor_ms; });
    json thread_ms;
    for (std::size_t s = 0; s < stages; ++s)
      if (best.stage_ms[s] >= 0.005) thread_ms[stage_names[s]] = best.stage_ms[s];
    return {{"x", x},
            {"median_ms", Times(wall).median},
            {"processor_ms", Times(processors).median},
            {"least_processor_ms", best.processor_ms},
            {"thread_ms", thread_ms},
            {"rays", best.last.rays},
            {"cells", best.last.cells},
            {"tiles", best.last.tiles},
            {"echoes", best.last.echoes},
            {"cell_bytes", best.last.cell_bytes}};
  }

 private:
  static constexpr auto stages = static_cast<std::size_t>(Stage::stages);
  struct Sample {  // one ping, or the mean of a round of pings
    double wall_ms = 0, processor_ms = 0;
    std::array<double, stages> stage_ms{};
    PingStatistics last;
  };
  int warm_up_ = 2;
  std::vector<Sample> samples_;
};

json point(double x, const ScenePointer& scene, const BenchCase& c, const BenchScene& where, const BenchOptions& options) {
  Bench bench(scene, 1, options);
  Pinger pinger(c, options);
  Samples samples;
  for (int k = 0; k < pings_a_point + 2; ++k)
    samples.add(1, *bench.engine, [&](int) { pinger.fire(*bench.engine, pinger.request(k, bench_pose(c, where, k / 40.0))); });
  return samples.point(x);
}

json curve(const char* name, const std::string& of, json points) {
  std::printf("curve %-32s", (std::string(name) + ", " + of + ":").c_str());
  for (const json& p : points) std::printf("  %g: %.2f ms", p["x"].get<double>(), p["least_processor_ms"].get<double>());
  std::printf("\n");
  std::fflush(stdout);
  return {{"name", name}, {"case", of}, {"points", std::move(points)}};
}

/// Returns the same bed, equally rough, on another grid or of another size; the sonar's place on it stays.
ScenePointer bed_of(const Scene& scene, double spacing_m, double size_m, double bed_z_m) {
  SeabedShape shape;
  shape.size_x_m = shape.size_y_m = shape.fine_x_m = shape.fine_y_m = size_m;
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

/// Measures rounds of `count` sonars, 2 m apart, that take turns over one scene. Returns the figures of one ping.
json sonars(int count, const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  const BenchCase c = *find_case("P3a");
  Bench bench(scene, 1, options);
  Pinger pinger(c, options);
  Samples samples;
  for (int k = 0; k < pings_a_point + 2; ++k)
    samples.add(count, *bench.engine, [&](int s) {
      Pose at = bench_pose(c, where, k / 40.0);
      at.position_m.y += 2.0 * (s - 0.5 * (count - 1));
      PingRequest request = pinger.request(k, at);
      request.sonar_id = static_cast<std::uint32_t>(s);
      pinger.fire(*bench.engine, request);
    });
  return samples.point(count);
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
  for (const int rays : {38, 75, 150, 300, 600, 1200}) {
    BenchCase c = *find_case("P1");
    c.fixed_fan = rays;
    points.push_back(point(rays, scene, c, where, options));
  }
  finish("rays a column", "P1 with a fixed fan");
  for (const int rows : {109, 218, 437, 874, 1748, 3496}) {
    BenchCase c = *find_case("P3a");
    c.settings.range_bin_count = rows;
    c.settings.range_bin_m = c.settings.range_m / rows;
    c.settings.pulse_width_m = static_cast<float>(0.9 * c.settings.range_bin_m);
    points.push_back(point(rows, scene, c, where, options));
  }
  finish("rows", "P3a, pulse 0.9 of a row");
  for (const int beams : {32, 64, 128, 256, 512, 1024}) {
    BenchCase c = *find_case("P3a");
    c.settings.beam_count = beams;
    points.push_back(point(beams, scene, c, where, options));
  }
  finish("beams", "P3a");
  for (const double spacing_m : {0.56, 0.28, 0.14, 0.07, 0.035, 0.0177, 0.0128}) {  // 10^4 to 2 x 10^7 triangles
    const ScenePointer bed = bed_of(*scene, spacing_m, 40, where.bed_z_m);
    points.push_back(point(static_cast<double>(bed->triangle_count()), bed, *find_case("P1"), where, options));
  }
  finish("triangles, finer", "P1 over a rough bed of 40 x 40 m");
  for (const double size_m : {40, 80, 160, 316}) {
    const ScenePointer bed = bed_of(*scene, 0.1, size_m, where.bed_z_m);
    points.push_back(point(static_cast<double>(bed->triangle_count()), bed, *find_case("P1"), where, options));
  }
  finish("triangles, wider", "P1 over a rough bed with a grid of 0.1 m");
  for (const int count : {1, 2, 4, 8, 16}) points.push_back(sonars(count, scene, where, options));
  finish("sonars", "P3a, alternating, per ping");
  return curves;
}

}  // namespace sonar::bench
