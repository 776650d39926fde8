// Memory per triangle while a large scene is made: 20 million triangles must fit into a small computer.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "core/scene/files/load_mesh.hpp"
#include "core/scene/ray_scene.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar {
namespace {

double bytes_after(const char* word) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(word)) return 1024.0 * std::strtod(line.c_str() + std::strlen(word), nullptr);
  return 0;
}

// The peak memory of the process while `work` runs, minus its memory before.
template <class Work>
double peak_bytes(Work&& work) {
  std::ofstream("/proc/self/clear_refs") << "5";  // resets the peak
  const double before = bytes_after("VmRSS:"), earlier_peak = bytes_after("VmHWM:");
  work();
  EXPECT_LT(earlier_peak, before * 1.1 + 1e6) << "the system keeps the peak of earlier work";
  return bytes_after("VmHWM:") - before;
}

float wave(std::size_t i, std::size_t j) {
  return 0.3f * std::sin(0.02f * static_cast<float>(i)) * std::cos(0.03f * static_cast<float>(j));
}

class SceneMemory : public ::testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "a sanitizer's memory is not the scene's";
#endif
  }
};

TEST_F(SceneMemory, AMillionTrianglesInBinaryStlTakeLittleMemory) {
  constexpr std::size_t edge = 708, count = 2 * (edge - 1) * (edge - 1);
  const tests::TemporaryFiles files;
  std::string bytes(80, '\0');
  const auto triangles = static_cast<std::uint32_t>(count);
  bytes.append(reinterpret_cast<const char*>(&triangles), 4);
  const auto corner = [&](std::size_t i, std::size_t j) {
    const float p[3] = {0.1f * static_cast<float>(i), 0.1f * static_cast<float>(j), wave(i, j)};
    bytes.append(reinterpret_cast<const char*>(p), sizeof p);
  };
  const auto triangle = [&](std::size_t i, std::size_t j, std::size_t di, std::size_t dj) {
    bytes.append(12, '\0');
    corner(i, j), corner(i + di, j + dj), corner(i + 1, j + 1);
    bytes.append(2, '\0');
  };
  for (std::size_t j = 0; j + 1 < edge; ++j)
    for (std::size_t i = 0; i + 1 < edge; ++i) triangle(i, j, 1, 0), triangle(i, j, 0, 1);
  MeshFile request;
  request.file = files.write("bed.stl", bytes);
  bytes = std::string();
  Result<LoadedMesh> mesh;
  const double peak = peak_bytes([&] { mesh = load_mesh(request); });
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->centred.mesh.triangles.size(), count);
  EXPECT_EQ(mesh->centred.mesh.vertices.size(), edge * edge);
  EXPECT_LT(peak / static_cast<double>(count), 45) << "bytes per triangle";  // 31; the importer needs 240
}

TEST_F(SceneMemory, TwoMillionTracedTrianglesTakeLittleMemory) {
  constexpr std::size_t edge = 1001;
  HeightGrid grid;
  for (std::size_t i = 0; i < edge; ++i) grid.x.push_back(0.1 * static_cast<double>(i));
  grid.y = grid.x;
  for (std::size_t j = 0; j < edge; ++j)
    for (std::size_t i = 0; i < edge; ++i) grid.z_m.push_back(wave(i, j));
  auto scene = std::make_shared<Scene>();
  scene->materials.resize(1);
  scene->objects.push_back({.name = "bed", .mesh = std::make_shared<const Mesh>(mesh_from_grid(grid)->mesh), .in_world = {}});
  ASSERT_GE(scene->triangle_count(), RayScene::compact_from_triangles);
  std::unique_ptr<RayScene> rays;
  const double peak = peak_bytes([&] { rays = std::make_unique<RayScene>(scene, 1); });
  RayPacket down{};
  down.direction_z[0] = -1, down.far[0] = 10, down.origin_z[0] = 5, down.origin_x[0] = 0.03f;
  rays->trace(down, 1u, false);
  EXPECT_EQ(down.object[0], 0u);
  EXPECT_LT(peak / static_cast<double>(scene->triangle_count()), 60) << "bytes per triangle";  // 36; 101 in the larger form
}

}  // namespace
}  // namespace sonar
