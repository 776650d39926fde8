#include "tests/core/pipeline/scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace sonar::test {
namespace {

using Index = std::uint32_t;

void quad(Mesh& mesh, Index a, Index b, Index c, Index d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}
void paint(Mesh& mesh, std::uint16_t material) { mesh.material.assign(mesh.triangles.size(), material); }

Vec3 on_sphere(Vec3d v, double radius) { return to_float((radius / length(v)) * v); }

}  // namespace

Mesh height_field(double x0, double x1, double y0, double y1, double step_m, const std::function<double(double, double)>& z) {
  const int nx = std::max(1, static_cast<int>(std::lround((x1 - x0) / step_m)));
  const int ny = std::max(1, static_cast<int>(std::lround((y1 - y0) / step_m)));
  Mesh mesh;
  for (int j = 0; j <= ny; ++j) {
    for (int i = 0; i <= nx; ++i) {
      const double x = x0 + (x1 - x0) * i / nx, y = y0 + (y1 - y0) * j / ny;
      mesh.vertices.push_back(to_float({x, y, z(x, y)}));
    }
  }
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const auto a = static_cast<Index>(j * (nx + 1) + i), up = static_cast<Index>(nx + 1);
      quad(mesh, a, a + 1, a + up + 1, a + up);
    }
  }
  return mesh;
}

Mesh wall(double half_width_m, double half_height_m) {
  const auto w = static_cast<float>(half_width_m), h = static_cast<float>(half_height_m);
  Mesh mesh;
  mesh.vertices = {{0, -w, -h}, {0, w, -h}, {0, w, h}, {0, -w, h}};
  quad(mesh, 0, 1, 2, 3);
  return mesh;
}

Mesh box(Vec3d half_size_m) {
  Mesh mesh;
  const Vec3 h = to_float(half_size_m);
  for (int i = 0; i < 8; ++i) mesh.vertices.push_back({i & 1 ? h.x : -h.x, i & 2 ? h.y : -h.y, i & 4 ? h.z : -h.z});
  quad(mesh, 0, 2, 3, 1), quad(mesh, 4, 5, 7, 6);
  quad(mesh, 0, 1, 5, 4), quad(mesh, 2, 6, 7, 3);
  quad(mesh, 0, 4, 6, 2), quad(mesh, 1, 3, 7, 5);
  return mesh;
}

Mesh sphere(double radius_m, int halvings) {
  std::vector<Vec3d> points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<Index, 3>> faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                             {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int n = 0; n < halvings; ++n) {
    std::map<std::pair<Index, Index>, Index> middles;
    const auto middle = [&](Index a, Index b) {
      const auto [it, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<Index>(points.size()));
      if (fresh) {
        const Vec3d m = points[a] + points[b];
        points.push_back((1 / length(m)) * m);
      }
      return it->second;
    };
    std::vector<std::array<Index, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  Mesh mesh;
  mesh.triangles = std::move(faces);
  for (const Vec3d& p : points) mesh.vertices.push_back(on_sphere(p, radius_m));
  return mesh;
}

std::function<double(double, double)> rough_relief(double rms_height_m, int waves) {
  struct Wave {
    double kx, ky, phase;
  };
  std::mt19937 random(1234);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<Wave> all;
  for (int i = 0; i < waves; ++i) {
    const double direction = 2 * pi * uniform(), length_m = 0.3 * std::pow(10.0, uniform());
    all.push_back({2 * pi / length_m * std::cos(direction), 2 * pi / length_m * std::sin(direction), 2 * pi * uniform()});
  }
  const double amplitude = rms_height_m * std::sqrt(2.0 / waves);
  return [all, amplitude](double x, double y) {
    double z = 0;
    for (const Wave& w : all) z += amplitude * std::cos(w.kx * x + w.ky * y + w.phase);
    return z;
  };
}

std::uint16_t SceneMaker::add_material(Material material) {
  material.name = "material " + std::to_string(scene_.materials.size());
  scene_.materials.push_back(std::move(material));
  return static_cast<std::uint16_t>(scene_.materials.size() - 1);
}

SceneMaker& SceneMaker::add(Mesh mesh, double lambert_db, Vec3d position_m, Quatd orientation) {
  Material material;
  material.lambert_db = static_cast<float>(lambert_db);
  return add_of(std::move(mesh), material, position_m, orientation);
}

SceneMaker& SceneMaker::add_of(Mesh mesh, const Material& material, Vec3d position_m, Quatd orientation) {
  paint(mesh, add_material(material));
  Object object;
  object.name = "object " + std::to_string(scene_.objects.size());
  object.mesh = std::make_shared<const Mesh>(std::move(mesh));
  object.in_world = {position_m, orientation};
  scene_.objects.push_back(object);
  return *this;
}

SceneMaker& SceneMaker::add_body(Mesh mesh, double lambert_db, Pose in_world) {
  add(std::move(mesh), lambert_db, in_world.position_m, in_world.orientation);
  scene_.objects.back().body = static_cast<int>(scene_.bodies_in_world.size());
  scene_.body_names.push_back("body " + std::to_string(scene_.bodies_in_world.size()));
  scene_.bodies_in_world.push_back(in_world);
  return *this;
}

SceneMaker& SceneMaker::add_point(Vec3d position_m, double target_strength_db) {
  PointTarget target;
  target.name = "point " + std::to_string(scene_.point_targets.size());
  target.position_m = position_m;
  target.target_strength_db = static_cast<float>(target_strength_db);
  scene_.point_targets.push_back(target);
  return *this;
}

}  // namespace sonar::test
