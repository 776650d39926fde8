// Shared by the tests of mesh files: a wedge in all formats, and a fixture that loads files.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/scene/files/load_mesh.hpp"
#include "tests/core/scene/mesh_checks.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::load_mesh_testing {

// A wedge: 2 long in x, 1 wide in y, 3 high in z.
inline const std::string obj =
    "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 3\nusemtl steel\nf 1 3 2\nf 1 2 4\nusemtl wood\nf 1 4 3\nf 2 3 4\n";
inline const std::string ply =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n2 0 0\n0 1 0\n0 0 3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
inline const std::string stl =
    "solid wedge\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 2 0 0\nendloop\nendfacet\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 0 3\nendloop\nendfacet\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 3\nvertex 0 1 0\nendloop\nendfacet\n"
    "facet normal 0 0 0\nouter loop\nvertex 2 0 0\nvertex 0 1 0\nvertex 0 0 3\nendloop\nendfacet\n"
    "endsolid wedge\n";

// The same wedge as binary STL. Its header begins like that of a text file.
inline std::string binary_stl() {
  const float corner[4][3] = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, 0, 3}};
  const int triangle[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string out = "solid wedge";
  out.resize(80);
  out.append("\4\0\0\0", 4);
  for (const auto& t : triangle) {
    out.append(12, '\0');
    for (const int k : t) out.append(reinterpret_cast<const char*>(corner[k]), 12);
    out.append(2, '\0');
  }
  return out;
}

inline std::string collada(const std::string& axis) {
  return "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">"
         "<asset><unit meter=\"1\"/><up_axis>" +
         axis +
         "</up_axis></asset><library_geometries><geometry id=\"g\"><mesh>"
         "<source id=\"p\"><float_array id=\"a\" count=\"12\">0 0 0 2 0 0 0 1 0 0 0 3</float_array><technique_common>"
         "<accessor source=\"#a\" count=\"4\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
         "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices id=\"v\"><input "
         "semantic=\"POSITION\" "
         "source=\"#p\"/></vertices><triangles count=\"4\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>"
         "<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries><library_visual_scenes>"
         "<visual_scene id=\"s\"><node><instance_geometry url=\"#g\"/></node></visual_scene></library_visual_scenes>"
         "<scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>";
}

// A GLB with the wedge's vertices and triangles in the glTF 2.0 container. `nodes` nodes show the wedge.
inline std::string glb(int nodes = 1) {
  const float vertices[12] = {0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 3};
  const std::uint16_t indices[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  std::string numbers = "0", shown = R"({"mesh":0})";
  for (int i = 1; i < nodes; ++i) {
    numbers += "," + std::to_string(i);
    shown += R"(,{"mesh":0})";
  }
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + numbers + R"(]}],"nodes":[)" + shown +
      "],"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":72}],)"
      R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[2,1,3]},)"
      R"({"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})";
  while (json.size() % 4) json += ' ';
  std::string out;
  const auto word = [&](std::size_t v) {
    for (int k = 0; k < 4; ++k) out += static_cast<char>((v >> (8 * k)) & 0xFF);
  };
  out += "glTF";
  word(2), word(12 + 8 + json.size() + 8 + 72);
  word(json.size());
  out += "JSON" + json;
  word(72);
  out.append("BIN\0", 4);
  std::string data(72, '\0');
  std::memcpy(data.data(), vertices, 48);
  std::memcpy(data.data() + 48, indices, 24);
  return out + data;
}

struct Corners {
  Vec3d low, high;
};
inline Corners extent(const CentredMesh& m) {
  Corners e{{1e30, 1e30, 1e30}, {-1e30, -1e30, -1e30}};
  for (const Vec3& v : m.mesh.vertices) {
    const Vec3d p = to_double(v) + m.centre_m;
    e.low = {std::min(e.low.x, p.x), std::min(e.low.y, p.y), std::min(e.low.z, p.z)};
    e.high = {std::max(e.high.x, p.x), std::max(e.high.y, p.y), std::max(e.high.z, p.z)};
  }
  return e;
}
inline void expect_extent(const LoadedMesh& m, Vec3d low, Vec3d high) {
  tests::expect_sound(m.centred.mesh);
  EXPECT_EQ(m.centred.mesh.triangles.size(), 4u);
  EXPECT_EQ(m.centred.mesh.vertices.size(), 4u);
  const Corners e = extent(m.centred);
  EXPECT_LT(length(e.low - low), 1e-5) << e.low.x << " " << e.low.y << " " << e.low.z;
  EXPECT_LT(length(e.high - high), 1e-5) << e.high.x << " " << e.high.y << " " << e.high.z;
}

class LoadMesh : public ::testing::Test {
 protected:
  LoadedMesh good(const std::string& name, const std::string& bytes, MeshFile request = {}) {
    request.file = files_.write(name, bytes);
    auto mesh = load_mesh(request);
    if (!mesh) throw std::runtime_error(mesh.error().text);
    return std::move(*mesh);
  }
  std::string refusal(const std::string& name, const std::string& bytes, MeshFile request = {}) {
    request.file = files_.write(name, bytes);
    auto mesh = load_mesh(request);
    return mesh ? "accepted" : mesh.error().text;
  }
  tests::TemporaryFiles files_;
};

}  // namespace sonar::load_mesh_testing
