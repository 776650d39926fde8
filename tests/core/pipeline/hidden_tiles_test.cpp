// Tiles of a ping, one by one. No cell of a tile that is skipped as hidden may echo. Labels get the same energy from the echoes
// as from a ping in expected power.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/pipeline/hidden_tiles.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/pipeline/trace_fan.hpp"
#include "tests/core/pipeline/kernel_sets.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

/// Returns a bed 2 m below the sonar, a box that hides other boxes, and a sphere nearby.
std::shared_ptr<const Scene> crowded_scene() {
  SceneMaker scene;
  scene.add(height_field(-2, 12, -8, 8, 0.2, rough_relief(0.1, 20)), -25, {0, 0, -2});
  scene.add(box({0.1, 1.5, 1}), -15, {4, 0.5, -1});
  for (const double y : {-0.5, 0.4, 1.2}) scene.add(box({0.3, 0.3, 0.4}), -15, {5.5, y, -1.4});
  scene.add(sphere(0.5, 3), -15, {1.2, -0.8, -1.2});
  return scene.make();
}

struct Case {
  const char* name;
  bool conical, moves, side_lobes;
};
constexpr Case cases[] = {{"cones", true, false, false},
                          {"flat", false, false, false},
                          {"cones, moving", true, true, false},
                          {"flat, moving", false, true, false},
                          {"cones, moving, side lobes", true, true, true}};

struct Counts {
  std::size_t tiles = 0, left_out = 0, echoes = 0;
};

/// Calls f(kernels, group, tile, is_skipped) for every tile in view of a group of columns.
template <class F>
void for_each_tile(const Case& c, const Pose& pose, int first, int last, const F& f) {
  Sounding sounding(crowded_scene(), oculus_low(), default_rows(8, 300));
  PingRequest& request = sounding.request;
  request.sonar_in_world = pose;
  request.switches.conical = c.conical, request.switches.side_lobes = c.side_lobes;
  if (c.moves) request.sonar_moves = {{0.8, -0.9, 0.3}, {0.2, -0.3, 0.4}};
  const auto scene = crowded_scene();
  Parallel pool(1);
  RayScene rays(scene, 1);
  SurfaceCells cells(scene, Seed{1}, 1 << 28);
  const PingPlan plan = make_plan(sounding.mode(), request.settings, request.switches);
  const PingScalars scalars = make_scalars(plan, request, rays.origin());
  const std::vector<LawTable> laws = laws_of(*scene, plan, scalars);
  const std::vector<float> away = turned_away_of(*scene, cells.skins(), {}, scalars.seen_from.position_m);
  CellView view;
  view.sonar_in_world = scalars.seen_from;
  view.min_range_m = static_cast<float>(scalars.min_range_m), view.max_range_m = static_cast<float>(scalars.max_range_m);
  plan.aim(view);
  const std::vector<TileInView>& in_view = cells.in_view(view, pool);
  for (const simd::Kernels* kernels : kernel_sets()) {
    const PingContext context{rays, cells, {}, laws, away, plan, scalars, *kernels, pool};
    std::vector<PreparedTile> tiles;
    prepare_tiles(context, in_view, cells.sonar_from_objects(), tiles);
    const int beside = scalars.columns_turned(plan);
    DepthMap map;
    map.shape(std::max(first - beside, 0), std::min(last + beside, plan.columns.count), plan.fan.bins);
    FanScratch scratch;
    trace_fan(rays, plan, scalars, map.first_column, map.first_column + map.columns, scratch, map);
    const simd::GroupView group = make_group_view(plan, scalars, map, first, last);
    FarthestSeen farthest;
    farthest.shape(map);
    std::vector<std::vector<std::uint32_t>> by_group;
    sort_tiles(tiles, std::vector<ColumnRange>{{0, plan.columns.count}}, by_group);
    std::vector<std::uint32_t> in_sight;
    farthest.leave_out_hidden(tiles, by_group[0], group, in_sight);
    EXPECT_TRUE(std::is_sorted(in_sight.begin(), in_sight.end()));
    for (std::uint32_t i = 0; i < tiles.size(); ++i)
      f(*kernels, group, tiles[i].seen, !std::binary_search(in_sight.begin(), in_sight.end(), i));
  }
}

constexpr Vec3d place{0, 0, -0.3};

TEST(HiddenTiles, OmittedTilesHaveNoEcho) {
  for (const Case& c : cases) {
    Counts all, narrow;
    const auto look = [&](double yaw, int first, int last, Counts& counts) {
      for_each_tile(c, {place, quat_from_rpy({0.05, 0.2, yaw})}, first, last,
                    [&](const simd::Kernels& kernels, const simd::GroupView& group, const simd::TileSeen& tile, bool left_out) {
                      Echoes echoes(tile.tile->count);
                      const int heard = kernels.scatter_tile(tile, group, echoes.at(0));
                      counts.tiles += 1, counts.left_out += left_out, counts.echoes += static_cast<std::size_t>(heard);
                      EXPECT_FALSE(left_out && heard > 0) << c.name << ", " << kernels.name << ": " << heard << " echoes";
                    });
    };
    for (const double yaw : {-0.6, 0.7}) {
      look(yaw, 0, 512, all);
      look(yaw, 160, 208, narrow);
    }
    EXPECT_GT(all.echoes, 100'000u) << c.name;
    EXPECT_GT(narrow.echoes, 10'000u) << c.name;
    EXPECT_GT(all.left_out, all.tiles / 4) << c.name << ": " << all.left_out << " of " << all.tiles;
  }
}

TEST(TilesForLabels, PowerBesideTheEchoesIsThatOfExpectedPower) {
  std::size_t compared = 0;
  for_each_tile(cases[4], {place, quat_from_rpy({0.05, 0.2, 0.1})}, 0, 512,
                [&](const simd::Kernels& kernels, const simd::GroupView& group, const simd::TileSeen& tile, bool) {
                  Echoes echoes, expected(tile.tile->count);
                  echoes.keeps_power = true;
                  echoes.reserve(tile.tile->count);
                  const auto heard = static_cast<std::size_t>(kernels.scatter_tile(tile, group, echoes.at(0)));
                  simd::GroupView in_power = group;
                  in_power.expected_power = true;
                  ASSERT_EQ(static_cast<std::size_t>(kernels.scatter_tile(tile, in_power, expected.at(0))), heard);
                  for (std::size_t i = 0; i < heard; ++i) {
                    EXPECT_EQ(echoes.power[i], expected.re[i]);
                    EXPECT_EQ(echoes.sample[i], expected.sample[i]);
                    EXPECT_EQ(echoes.column[i], expected.column[i]);
                  }
                  compared += heard;
                });
  EXPECT_GT(compared, 50'000u);
}

}  // namespace
}  // namespace sonar::test
