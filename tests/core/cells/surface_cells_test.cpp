#include "core/scene/cells/surface_cells.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/random.hpp"
#include "core/scene/cells/cell_lattice.hpp"

namespace sonar {
namespace {

using HeightAt = double (*)(double, double);

/// Returns a grid of `n` x `n` squares over [0, size]^2, each split along a diagonal that alternates.
std::shared_ptr<Mesh> terrain(int n, double size, HeightAt height) {
  auto mesh = std::make_shared<Mesh>();
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = size * i / n, y = size * j / n;
      mesh->vertices.push_back(to_float(Vec3d{x, y, height(x, y)}));
    }
  const auto at = [n](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
      if ((i + j) % 2) {
        mesh->triangles.push_back({a, b, c});
        mesh->triangles.push_back({a, c, d});
      } else {
        mesh->triangles.push_back({a, b, d});
        mesh->triangles.push_back({b, c, d});
      }
    }
  mesh->material.assign(mesh->triangles.size(), 0);
  return mesh;
}

std::shared_ptr<Mesh> sphere(double radius, int rings) {
  auto mesh = std::make_shared<Mesh>();
  for (int r = 0; r <= rings; ++r)
    for (int s = 0; s < 2 * rings; ++s) {
      const double theta = pi * r / rings, phi = pi * s / rings;
      mesh->vertices.push_back(
          to_float(radius * Vec3d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)}));
    }
  const auto at = [rings](int r, int s) { return static_cast<std::uint32_t>(r * 2 * rings + s % (2 * rings)); };
  for (int r = 0; r < rings; ++r)
    for (int s = 0; s < 2 * rings; ++s) {
      if (r > 0) mesh->triangles.push_back({at(r, s), at(r + 1, s), at(r, s + 1)});
      if (r + 1 < rings) mesh->triangles.push_back({at(r, s + 1), at(r + 1, s), at(r + 1, s + 1)});
    }
  mesh->material.assign(mesh->triangles.size(), 0);
  return mesh;
}

std::shared_ptr<const Scene> scene_of(std::shared_ptr<const Mesh> mesh) {
  auto scene = std::make_shared<Scene>();
  scene->materials.emplace_back();
  Object object;
  object.name = "it";
  object.mesh = std::move(mesh);
  scene->objects.push_back(object);
  return scene;
}

/// Returns a view of everything in front of a sonar that looks along +x from far behind, at one level.
CellView whole_scene(int level, Vec3d from = {-200, 0, 0}) {
  CellView view;
  view.sonar_in_world.position_m = from;
  view.max_range_m = 1000;
  view.max_sine = 1;
  view.max_elevation_rad = 1.4f;
  view.levels = {{level, 0, 0, 1e6f, 1e6f}};
  return view;
}

bool real(const CellTile& t, int i) { return t.column(CellTile::weight_re)[i] != 0 || t.column(CellTile::weight_im)[i] != 0; }

Vec3d place(const CellTile& t, int i) {
  const double unit = static_cast<double>(t.position_unit_m);
  return t.centre_m + Vec3d{unit * t.column(CellTile::x)[i], unit * t.column(CellTile::y)[i], unit * t.column(CellTile::z)[i]};
}

double gentle(double x, double y) { return 0.11 * std::sin(2.3 * x + 0.4) * std::cos(1.7 * y) + 0.05 * std::sin(9 * x + 5 * y); }

TEST(SurfaceCells, EveryLatticePointOfATerrainHasExactlyOneOwner) {
  SurfaceCells cells(scene_of(terrain(37, 4.0, gentle)), Seed{3}, 1u << 30);
  Parallel pool(1);
  const int level = 5;
  std::map<std::pair<long, long>, int> owners;
  for (const TileInView& t : cells.in_view(whole_scene(level), pool)) {
    ASSERT_EQ(t.tile->axis, 2);
    for (int i = 0; i < t.tile->count; ++i) {
      if (!real(*t.tile, i)) continue;
      const Vec3d p = place(*t.tile, i);
      // Rounding may move a point across the border of its cell by micrometres. Therefore the owners of neighbouring cells are
      // counted together below.
      ++owners[{std::lround(std::floor(p.x * 32)), std::lround(std::floor(p.y * 32))}];
    }
  }
  int total = 0, wrong = 0;
  for (const auto& [where, n] : owners) {
    total += n;
    wrong += n != 1;
  }
  EXPECT_EQ(total, 128 * 128);
  EXPECT_LE(wrong, 20);  // allowed: rounding of stored positions
}

// Condition of a uniform flat bed (docs/acoustics.md, section 3): each strip of a sixteenth of a block, of any shape, contains
// one point.
TEST(SurfaceCells, SixteenNeighboursShareTheirBlockOutEvenly) {
  SurfaceCells cells(scene_of(terrain(1, 2.0, [](double, double) { return 0.0; })), Seed{5}, 1u << 30);
  Parallel pool(1);
  constexpr double blocks_per_m = 8;  // cells of 1 / 32 m
  std::map<std::tuple<int, long, long>, int> in_strip;
  double sum[2] = {}, corner = 0;
  int total = 0;
  for (const TileInView& t : cells.in_view(whole_scene(5), pool)) {
    for (int i = 0; i < t.tile->count; ++i) {
      if (!real(*t.tile, i)) continue;
      const Vec3d p = place(*t.tile, i);
      for (int shape = 0; shape < 5; ++shape) {
        const long strip_x = std::lround(std::floor(p.x * blocks_per_m * (1 << shape))),
                   strip_y = std::lround(std::floor(p.y * blocks_per_m * (16 >> shape)));
        ++in_strip[{shape, strip_x, strip_y}];
      }
      const double u = p.x * 32 - std::floor(p.x * 32), v = p.y * 32 - std::floor(p.y * 32);
      sum[0] += u, sum[1] += v, corner += u < 0.5 && v < 0.5;
      ++total;
    }
  }
  ASSERT_EQ(total, 64 * 64);
  int wrong = 0;
  for (const auto& [strip, n] : in_strip) wrong += n != 1;
  EXPECT_NEAR(static_cast<double>(in_strip.size()), 5 * 64 * 64, 12);
  EXPECT_LE(wrong, 12);                    // positions are stored to 1 / 4000 of a cell; rounding moves a few across a border
  EXPECT_NEAR(sum[0] / total, 0.5, 0.01);  // a point by itself is uniform in its cell
  EXPECT_NEAR(sum[1] / total, 0.5, 0.01);
  EXPECT_NEAR(corner / total, 0.25, 0.02);
}

TEST(SurfaceCells, CellsLieOnTheirTriangles) {
  SurfaceCells cells(scene_of(terrain(37, 4.0, gentle)), Seed{3}, 1u << 30);
  Parallel pool(1);
  const auto mesh = terrain(37, 4.0, gentle);
  double worst = 0;
  for (const TileInView& t : cells.in_view(whole_scene(6), pool))
    for (int i = 0; i < t.tile->count; i += 7) {
      if (!real(*t.tile, i)) continue;
      const Vec3d p = place(*t.tile, i);
      double nearest = 1;
      for (std::uint32_t f = 0; f < mesh->triangles.size(); ++f) {
        const lattice::Facet facet = lattice::facet_of(*mesh, f, 2);
        if (lattice::owns(facet, p.x, p.y)) nearest = std::min(nearest, std::abs(lattice::height(facet, p.x, p.y) - p.z));
      }
      worst = std::max(worst, nearest);
    }
  EXPECT_LT(worst, 2e-5);
}

TEST(SurfaceCells, AreasAddUpToTheSurface) {
  const double radius = 0.7;
  SurfaceCells cells(scene_of(sphere(radius, 40)), Seed{1}, 1u << 30);
  Parallel pool(1);
  const int level = 6;
  double area = 0;
  for (const TileInView& t : cells.in_view(whole_scene(level), pool))
    for (int i = 0; i < t.tile->count; ++i) {
      if (!real(*t.tile, i)) continue;
      const auto axis = static_cast<CellTile::Column>(CellTile::normal_x + t.tile->axis);
      area += std::pow(lattice::cell_size_m(level), 2) /
              std::abs(t.tile->column(axis)[i] * static_cast<double>(CellTile::normal_unit));
    }
  EXPECT_NEAR(area / (4 * pi * radius * radius), 1.0, 0.01);
}

TEST(SurfaceCells, SpeckleIsCircularGaussianWithTheCellsArea) {
  SurfaceCells cells(scene_of(terrain(2, 8.0, [](double, double) { return 0.0; })), Seed{9}, 1u << 30);
  Parallel pool(1);
  const int level = 5;
  double n = 0, power = 0, fourth = 0;
  std::complex<double> mean = 0, pseudo = 0;
  for (const TileInView& t : cells.in_view(whole_scene(level), pool))
    for (int i = 0; i < t.tile->count; ++i) {
      if (!real(*t.tile, i)) continue;
      const std::complex<double> w(t.tile->column(CellTile::weight_re)[i], t.tile->column(CellTile::weight_im)[i]);
      const std::complex<double> xi = w * static_cast<double>(t.tile->weight_unit) / lattice::cell_size_m(level);
      n += 1;
      power += std::norm(xi);
      fourth += std::norm(xi) * std::norm(xi);
      mean += xi;
      pseudo += xi * xi;
    }
  ASSERT_EQ(n, 256 * 256);
  EXPECT_NEAR(power / n, 1.0, 0.02);
  EXPECT_NEAR(fourth / n, 2.0, 0.08);
  EXPECT_LT(std::abs(mean) / n, 0.015);
  EXPECT_LT(std::abs(pseudo) / n, 0.02);
}

std::vector<std::int16_t> bytes_of(const std::vector<TileInView>& tiles) {
  std::vector<std::int16_t> all;
  for (const TileInView& t : tiles)
    all.insert(all.end(), t.tile->data.get(), t.tile->data.get() + t.tile->stride * CellTile::columns);
  return all;
}

TEST(SurfaceCells, BytesAreTheSameForAnyPoolAndAfterEviction) {
  const auto scene = scene_of(terrain(20, 4.0, gentle));
  Parallel one(1), three(3);
  SurfaceCells a(scene, Seed{5}, 1u << 30), b(scene, Seed{5}, 1u << 30), small(scene, Seed{5}, 1u << 16);
  const auto first = bytes_of(a.in_view(whole_scene(6), one));
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(first, bytes_of(b.in_view(whole_scene(6), three)));

  CellView near = whole_scene(6, {-1, 0, 1});
  near.max_range_m = 1.5f;
  EXPECT_EQ(first, bytes_of(small.in_view(whole_scene(6), one)));
  small.in_view(near, one);
  EXPECT_LE(small.cached_bytes(), std::size_t{1} << 19);
  EXPECT_EQ(first, bytes_of(small.in_view(whole_scene(6), one)));
  EXPECT_GT(small.built_last_time(), 0u);
  b.in_view(whole_scene(6), one);
  EXPECT_EQ(b.built_last_time(), 0u);
}

TEST(SurfaceCells, SeveralViewsAtOnceFindWhatEachFindsAlone) {
  const auto scene = scene_of(terrain(20, 4.0, gentle));
  Parallel one(1), three(3);
  std::vector<CellView> views;
  for (int k = 0; k < 7; ++k) {
    views.push_back(whole_scene(4 + k % 3, {0.3 * k, 0, 1}));
    views.back().max_range_m = 2.0f + 0.5f * static_cast<float>(k);
  }
  SurfaceCells alone(scene, Seed{5}, 1u << 30);
  CellView nothing = whole_scene(4, {0, 0, 500});
  nothing.max_range_m = 1;
  // With a tiny budget all cells are removed if no cell is in view, and no cell is removed within one call.
  for (const std::size_t budget : {std::size_t{1} << 30, std::size_t{1} << 12}) {
    SurfaceCells together(scene, Seed{5}, budget);
    for (int again = 0; again < 2; ++again) {
      std::vector<CellsInView> found(views.size());
      together.in_views(views, three, found);
      for (std::size_t v = 0; v < views.size(); ++v) {
        const auto& expected = alone.in_view(views[v], one);
        ASSERT_FALSE(expected.empty());
        EXPECT_EQ(bytes_of(found[v].tiles), bytes_of(expected)) << v;
        ASSERT_EQ(found[v].sonar_from_object.size(), scene->objects.size());
        for (int i = 0; i < 9; ++i)
          EXPECT_EQ(found[v].sonar_from_object[0].m[i / 3][i % 3], alone.sonar_from_object(0).m[i / 3][i % 3]);
        EXPECT_EQ(found[v].built > 0, again == 0 || budget < 1u << 20) << v;
      }
      together.in_view(nothing, one);
    }
  }
}

TEST(SurfaceCells, AnObjectAttachedToABodyHasItsCellsWhereItIs) {
  const Pose attached{{1.5, -0.4, 0.3}, quat_from_rpy({0.2, -0.1, 0.7})};  // pose in the body
  const Pose body_then{{9, 9, -9}, quat_from_rpy({0, 0, 2})}, body_now{{3, 1, 0.5}, quat_from_rpy({0.1, 0.3, -0.4})};
  auto fixed = std::make_shared<Scene>(*scene_of(sphere(0.4, 12)));
  auto riding = std::make_shared<Scene>(*fixed);
  fixed->objects[0].in_world = compose(body_now, attached);
  riding->objects[0].in_world = compose(body_then, attached);
  riding->objects[0].body = 0;
  riding->body_names = {"rider"};
  riding->bodies_in_world = {body_then};

  Parallel pool(1);
  SurfaceCells a(fixed, Seed{5}, 1u << 30), b(riding, Seed{5}, 1u << 30);
  CellView view = whole_scene(6, {-2, 0, 0});
  const auto expected = a.in_view(view, pool);
  view.bodies_in_world = std::span(&body_now, 1);
  const auto found = b.in_view(view, pool);
  ASSERT_EQ(found.size(), expected.size());
  ASSERT_FALSE(found.empty());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_LT(length(found[i].from_sonar_m - expected[i].from_sonar_m), 1e-9);
  EXPECT_EQ(bytes_of(found), bytes_of(expected));  // the speckle moves with the object
}

TEST(SurfaceCells, ALongJourneyStaysWithinItsBudget) {
  const std::size_t budget = 4u << 20;
  SurfaceCells cells(scene_of(terrain(200, 100.0, gentle)), Seed{5}, budget),
      fresh(scene_of(terrain(200, 100.0, gentle)), Seed{5}, 1u << 30);
  Parallel pool(1);
  CellView view = whole_scene(5, {0, 50, 1});
  view.max_range_m = 4;
  std::size_t most = 0, everything = 0;
  for (int step = 0; step < 95; ++step) {
    view.sonar_in_world.position_m.x = step;
    cells.in_view(view, pool);
    fresh.in_view(view, pool);
    most = std::max(most, cells.cached_bytes());
    everything = fresh.cached_bytes();
  }
  EXPECT_LE(most, budget);
  EXPECT_GT(everything, 2 * budget);
  EXPECT_EQ(bytes_of(cells.in_view(view, pool)), bytes_of(fresh.in_view(view, pool)));
}

TEST(SurfaceCells, SeedAndTextureSeedChangeTheSpeckle) {
  const auto scene = scene_of(terrain(8, 2.0, gentle));
  auto other = std::make_shared<Scene>(*scene);
  other->materials[0].texture_seed = 1;
  Parallel pool(1);
  SurfaceCells a(scene, Seed{5}, 1u << 30), b(scene, Seed{6}, 1u << 30), c(other, Seed{5}, 1u << 30);
  const auto first = bytes_of(a.in_view(whole_scene(6), pool));
  EXPECT_NE(first, bytes_of(b.in_view(whole_scene(6), pool)));
  EXPECT_NE(first, bytes_of(c.in_view(whole_scene(6), pool)));
}

TEST(SurfaceCells, CullsWhatLiesBehindBesideOrBeyond) {
  SurfaceCells cells(scene_of(terrain(20, 4.0, gentle)), Seed{5}, 1u << 30);
  Parallel pool(1);
  CellView view = whole_scene(6, {-1, 2, 0.5});
  view.max_elevation_rad = 0.5f;
  const std::size_t all = cells.in_view(view, pool).size();
  ASSERT_GT(all, 0u);
  CellView narrow = view;
  narrow.max_sine = 0.1f;
  EXPECT_LT(cells.in_view(narrow, pool).size(), all / 2);
  CellView short_sighted = view;
  short_sighted.max_range_m = 2;
  EXPECT_LT(cells.in_view(short_sighted, pool).size(), all / 2);
  CellView away = view;
  away.sonar_in_world.orientation = quat_from_rpy({0, 0, pi});
  EXPECT_EQ(cells.in_view(away, pool).size(), 0u);
}

TEST(CellLattice, SharedEdgesHaveOneOwner) {
  // Points exactly on the shared edge, for both directions of the triangles.
  for (int flip = 0; flip < 2; ++flip) {
    Mesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    if (flip) mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
    mesh.material = {0, 0};
    for (int k = 1; k < 8; ++k) {
      const double on = k / 8.0;
      const int owners =
          lattice::owns(lattice::facet_of(mesh, 0, 2), on, on) + lattice::owns(lattice::facet_of(mesh, 1, 2), on, on);
      EXPECT_EQ(owners, 1) << "at " << on;
    }
  }
}

// These cells are coarser than the first cubes of a small body.
TEST(SurfaceCells, SmallBodiesHaveCellsOfAllSizes) {
  const auto scene = scene_of(sphere(1, 24));
  SurfaceCells from_coarse(scene, Seed{9}, 1u << 30), from_fine(scene, Seed{9}, 1u << 30);
  Parallel pool(2);
  const auto counted = [&](SurfaceCells& cells, const CellView& view) {
    int count = 0;
    for (const TileInView& t : cells.in_view(view, pool))
      for (int i = 0; i < t.tile->count; ++i) count += real(*t.tile, i);
    return count;
  };
  // Area of the six patches on their lattices (approximate) [m^2].
  const double shadows = 6 * 4 * std::asin(1 / std::sqrt(3)) / std::sqrt(2);
  const int coarse = counted(from_coarse, whole_scene(0));
  for (int level = 6; level >= 1; --level) {
    const double expected = shadows * std::ldexp(1.0, 2 * level);
    EXPECT_NEAR(counted(from_fine, whole_scene(level)), expected, 0.1 * expected + 3 * std::sqrt(expected)) << level;
  }
  EXPECT_GT(coarse, 0);
  // The order does not depend on which level was requested first.
  const CellView view = whole_scene(1);
  counted(from_fine, whole_scene(0));
  const auto first = from_coarse.in_view(view, pool), second = from_fine.in_view(view, pool);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t t = 0; t < first.size(); ++t) {
    ASSERT_EQ(first[t].tile->bytes(), second[t].tile->bytes());
    EXPECT_EQ(std::memcmp(first[t].tile->data.get(), second[t].tile->data.get(), first[t].tile->bytes()), 0);
  }
  // The same if only the side lobes request such coarse cells, and beside a finer level.
  CellView sides = whole_scene(4, {-10, 0, -10});
  sides.main_elevation_rad = 0.1f, sides.side_from_rad = 0.1f, sides.side_area_per_range_m = 1e6f, sides.side_coarser = 2;
  SurfaceCells beside(scene, Seed{9}, 1u << 30);
  EXPECT_EQ(counted(beside, sides), counted(from_fine, whole_scene(2)));
}

// When scenes alternate, kept tiles are equal to new ones, in the same order, at coarse and fine levels.
TEST(SurfaceCells, AnotherSceneHasTheCellsOfANewOne) {
  const auto one = terrain(20, 4.0, gentle), other = terrain(16, 4.0, gentle), ball = sphere(0.5, 12);
  const auto with = [&](std::vector<std::shared_ptr<const Mesh>> meshes, std::uint32_t texture_seed, float shape) {
    auto scene = std::make_shared<Scene>();
    Material material;
    material.texture = {shape, 0.5f}, material.texture_seed = texture_seed;
    scene->materials.push_back(material);
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      Object object;
      object.mesh = std::move(meshes[i]);
      object.visible = object.mesh != nullptr;
      object.in_world.position_m = {0.3 * static_cast<double>(i), 0, 0};
      if (!object.mesh) object.mesh = std::make_shared<const Mesh>();
      scene->objects.push_back(object);
    }
    return std::shared_ptr<const Scene>(scene);
  };
  const std::shared_ptr<const Scene> scenes[] = {with({one, ball}, 1, 0),
                                                 with({other, ball}, 1, 0),
                                                 with({one, ball}, 2, 0),
                                                 with({one, nullptr}, 2, 3),
                                                 with({ball, one}, 2, 3),
                                                 with({one, ball, ball}, 1, 3),
                                                 with({other, nullptr, ball}, 1, 3),
                                                 with({one, ball}, 1, 0)};
  for (const std::size_t budget : {std::size_t{1} << 30, std::size_t{1} << 18}) {
    Parallel pool(2);
    SurfaceCells changing(scenes[0], Seed{4}, budget);
    for (int round = 0; round < 2; ++round)
      for (std::size_t s = 0; s < std::size(scenes); ++s) {
        changing.change(scenes[s]);
        SurfaceCells fresh(scenes[s], Seed{4}, budget);
        for (const int level : {4, 0, 3}) {
          const CellView view = whole_scene(level);
          const auto &a = changing.in_view(view, pool), &b = fresh.in_view(view, pool);
          ASSERT_EQ(a.size(), b.size()) << "scene " << s << " level " << level;
          for (std::size_t t = 0; t < a.size(); ++t) {
            ASSERT_EQ(a[t].object, b[t].object);
            ASSERT_EQ(a[t].tile->bytes(), b[t].tile->bytes());
            ASSERT_EQ(std::memcmp(a[t].tile->data.get(), b[t].tile->data.get(), a[t].tile->bytes()), 0) << "scene " << s;
          }
        }
      }
  }
}

TEST(SurfaceCells, AnotherSceneWithTheSameSurfacesBuildsNoCells) {
  const auto mesh = terrain(20, 4.0, gentle);
  SurfaceCells cells(scene_of(mesh), Seed{4}, 1u << 30);
  Parallel pool(1);
  const CellView view = whole_scene(4);
  cells.in_view(view, pool);
  EXPECT_GT(cells.built_last_time(), 0u);
  cells.change(scene_of(terrain(16, 4.0, gentle)));
  cells.in_view(view, pool);
  EXPECT_GT(cells.built_last_time(), 0u);
  cells.change(scene_of(mesh));
  cells.in_view(view, pool);
  EXPECT_EQ(cells.built_last_time(), 0u);
}

// Every scene has its own surface, and old surfaces are dropped.
TEST(SurfaceCells, ScenesThatDoNotComeBackAreForgotten) {
  constexpr std::size_t budget = 1u << 20;
  SurfaceCells cells(scene_of(terrain(20, 4.0, gentle)), Seed{4}, budget);
  Parallel pool(1);
  std::vector<std::weak_ptr<const Mesh>> meshes;
  for (int i = 0; i < 40; ++i) {
    const std::shared_ptr<const Mesh> mesh = terrain(20, 4.0 + 0.01 * i, gentle);
    meshes.push_back(mesh);
    cells.change(scene_of(mesh));
    cells.in_view(whole_scene(4), pool);
    EXPECT_LT(cells.cached_bytes(), 2 * budget);
  }
  EXPECT_LT(std::count_if(meshes.begin(), meshes.end(), [](const auto& mesh) { return !mesh.expired(); }), 20);
}

}  // namespace
}  // namespace sonar
