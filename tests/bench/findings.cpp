#include "tests/bench/findings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "core/scene/ray_scene.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "daemon/commands/render/coverage.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::bench {
namespace {

using nlohmann::json;

constexpr int bodies = 100;

/// Returns the scene with boxes of 0.2 m over the bed ahead, ten rows of ten.
ScenePointer with_bodies(const Scene& scene, const BenchScene& where) {
  auto made = std::make_shared<Scene>(scene);
  auto box = make_box({0.2, 0.2, 0.2});
  box.material.assign(box.triangles.size(), 0);
  const auto mesh = std::make_shared<const Mesh>(std::move(box));
  for (int i = 0; i < bodies; ++i) {
    const Pose at{{where.start_m.x + 3 + 0.7 * (i % 10), where.start_m.y - 4 + 0.8 * (i / 10), where.bed_z_m + 0.5}, {}};
    const std::string name = "box " + std::to_string(i + 1);
    made->body_names.push_back(name);
    made->bodies_in_world.push_back(at);
    made->objects.push_back({.name = name, .mesh = mesh, .in_world = at, .body = static_cast<int>(made->body_names.size()) - 1});
  }
  return made;
}

std::vector<Pose> moved(std::vector<Pose> poses, int ping) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double t = ping / 40.0 + static_cast<double>(i);
    poses[i].position_m = poses[i].position_m + Vec3d{0.05 * std::sin(t), 0.05 * std::cos(t), 0.02 * std::sin(2 * t)};
    poses[i].orientation = quat_from_rpy({0, 0, 0.3 * t});
  }
  return poses;
}

}  // namespace

json find_cold_pings(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  json found = json::array();
  for (const char* name : {"P1", "P3d"}) {
    const BenchCase c = *find_case(name);
    Pinger pinger(c, options);
    for (const int threads : options.threads) {
      Bench bench(scene, threads, options);
      int number = 0;
      // Warm pings at the start of the first jump; then jumps to the corners of the bed.
      for (; number < 5; ++number) pinger.fire(*bench.engine, pinger.request(number, bench_pose_at(c, where, -3, 0, pi)));
      std::vector<double> cold, warm;
      double built = 0, seen = 0;
      for (const Vec3d place : {Vec3d{2, -10, 0}, Vec3d{2, 10, 0}, Vec3d{18, -10, 0}, Vec3d{18, 10, 0}}) {
        const Pose at = bench_pose_at(c, where, where.start_m.x + place.x, where.start_m.y + place.y, place.x < 10 ? 0 : -0.3);
        cold.push_back(1e3 * pinger.fire(*bench.engine, pinger.request(++number, at)));
        built += static_cast<double>(bench.engine->statistics().tiles_built);
        seen += static_cast<double>(bench.engine->statistics().tiles);
        warm.push_back(1e3 * pinger.fire(*bench.engine, pinger.request(++number, at)));
      }
      const Times cold_ms(cold), warm_ms(warm);
      const double share = seen > 0 ? std::min(1.0, built / seen) : 0;  // also counts empty tiles
      std::printf(
          "P3e  %-4s after a jump, %d thread%s: cold %.1f ms (worst %.1f), the next %.1f; %.0f %% of the tiles were new\n", name,
          threads, threads == 1 ? "" : "s", cold_ms.median, cold_ms.max, warm_ms.median, 100 * share);
      found.push_back({{"case", name}, {"threads", threads}, {"cold", cold_ms}, {"warm", warm_ms}, {"new_tiles", share}});
    }
  }
  std::fflush(stdout);
  return found;
}

json find_cost_of_objects(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  const BenchCase c = *find_case("P1");
  Pinger pinger(c, options);
  const ScenePointer crowded = with_bodies(*scene, where);
  const int threads = options.threads.front();
  Bench resting(crowded, threads, options), moving(crowded, threads, options), without(scene, threads, options);
  std::vector<double> added, rest_ms, move_ms, without_ms;
  for (int k = 0; k < options.pings + 3; ++k) {
    PingRequest request = pinger.request(k, bench_pose(c, where, 0));
    const auto timed = [&](Bench& bench) {
      const double begin = processor_s();
      pinger.fire(*bench.engine, request);
      return 1e3 * (processor_s() - begin);
    };
    const double none = timed(without);
    request.bodies_in_world = crowded->bodies_in_world;
    const double rest = timed(resting);
    request.bodies_in_world = moved(crowded->bodies_in_world, k);
    const double move = timed(moving);
    if (k < 3) continue;
    without_ms.push_back(none), rest_ms.push_back(rest), move_ms.push_back(move), added.push_back(move - rest);
  }
  RayScene rays(crowded, 1);
  std::vector<double> place_ms;
  for (int k = 0; k < 200; ++k) {
    const auto poses = moved(crowded->bodies_in_world, k);
    const double begin = this_thread_s();
    rays.place(poses);
    place_ms.push_back(1e3 * (this_thread_s() - begin));
  }
  const Times added_ms(added), placing(place_ms);
  std::printf(
      "P7   %d moving objects: placed in %.3f ms (best %.3f); a ping takes %.2f processor ms without, %.2f with them at rest, "
      "%.2f moving: %+.2f\n",
      bodies, placing.median, placing.min, Times(without_ms).median, Times(rest_ms).median, Times(move_ms).median,
      added_ms.median);
  std::fflush(stdout);
  return {{"objects", bodies},         {"threads", threads},       {"place", placing}, {"without", Times(without_ms)},
          {"at_rest", Times(rest_ms)}, {"moving", Times(move_ms)}, {"added", added_ms}};
}

json find_cost_of_side_lobes(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  json found = json::array();
  for (const char* name : {"P1", "P3a", "P3c", "P3d"}) {
    const BenchCase c = *find_case(name);
    std::array<BenchOptions, 2> each{options, options};  // without, with
    each[0].engine.switches.side_lobes = false, each[1].engine.switches.side_lobes = true;
    Pinger without(c, each[0]), with(c, each[1]);
    Bench bench(scene, 1, options);
    std::array<std::vector<double>, 2> ms;
    std::vector<double> ratios;
    const int warming = options.pings / 10 + 1;
    for (int k = 0; k < options.pings + warming; ++k) {
      const Pose at = bench_pose(c, where, k / 40.0);
      std::array<double, 2> took{};
      for (const std::size_t turn : {k % 2 == 0 ? 0u : 1u, k % 2 == 0 ? 1u : 0u}) {
        Pinger& pinger = turn == 0 ? without : with;
        const PingRequest request = pinger.request(k, at);
        const double begin = processor_s();
        pinger.fire(*bench.engine, request);
        took[turn] = 1e3 * (processor_s() - begin);
      }
      if (k < warming) continue;
      for (const std::size_t turn : {0u, 1u}) ms[turn].push_back(took[turn]);
      ratios.push_back(took[1] / took[0]);
    }
    const Times without_ms(ms[0]), with_ms(ms[1]), ratio(ratios);
    std::printf("P15  %-4s side lobes: %.2f processor ms without, %.2f with them: %+.1f %% (best %+.1f %%)\n", name,
                without_ms.median, with_ms.median, 100 * (ratio.median - 1), 100 * (with_ms.min / without_ms.min - 1));
    std::fflush(stdout);
    found.push_back({{"case", name}, {"without", without_ms}, {"with", with_ms}, {"ratio", ratio.median}});
  }
  return found;
}

json find_hashes(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  json found = json::array();
  for (const char* name : {"P1", "P3a", "P3d"}) {
    const BenchCase c = *find_case(name);
    Pinger pinger(c, options);
    std::set<std::string> hashes;
    for (const int threads : {1, 2, 4, 1}) {
      Bench bench(scene, threads, options);
      Sha256 hash;
      for (int k = 0; k < 3; ++k) {
        Ping ping;
        pinger.fire(*bench.engine, pinger.request(k, bench_pose(c, where, k / 4.0)), &ping);
        hash.add(ping.samples);
      }
      hashes.insert(hash.hex());
    }
    std::printf("P9   %-4s 3 pings with 1, 2, 4 and 1 threads: %s (%s)\n", name,
                hashes.size() == 1 ? "the same bytes" : "DIFFERENT BYTES", hashes.begin()->substr(0, 16).c_str());
    found.push_back({{"case", name}, {"same", hashes.size() == 1}, {"sha256", *hashes.begin()}});
  }
  std::fflush(stdout);
  return found;
}

Result<json> find_empty_bins(const BenchOptions& options) {
  json found = json::array();
  Parallel pool(options.threads.back());
  for (const char* name : {"P1", "P3b", "P4a"})
    for (const int rays : {0, 300}) {
      const BenchCase c = *find_case(name);
      if (rays == 0 && c.fixed_fan > 0) continue;  // this case has rays only, because its rows would need too many cells
      render::RenderJob job = render::over_a_level_bed(c.profile.model, c.settings, name);
      job.config.engine = options.engine;
      job = render::with_bed_only(job);
      job.config.engine.switches.fixed_fan = rays;
      const auto engine = make_cpu_engine(job.scene, pool, {.simd = job.config.engine.simd});
      PingRequest request = render::make_request(job, render::world_of(job), PingNumber{1}, Time{});
      request.switches.keep_pressure = true;
      const auto coverage = render::measure_coverage(job, engine->run({&request, 1}).at(0));
      if (!coverage) return tl::make_unexpected(coverage.error());
      const double share = static_cast<double>(coverage->empty) / static_cast<double>(coverage->bins);
      std::printf("P12  %-4s %-22s %5d rows: %.3f %% of %zu bins have no energy\n", name,
                  rays > 0 ? "one scatterer a ray" : "surface cells", c.settings.range_bin_count, 100 * share, coverage->bins);
      found.push_back({{"case", name},
                       {"rays", rays},
                       {"rows", c.settings.range_bin_count},
                       {"bins", coverage->bins},
                       {"empty_share", share}});
    }
  std::fflush(stdout);
  return found;
}

}  // namespace sonar::bench
