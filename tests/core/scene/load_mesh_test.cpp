// Mesh files: all formats, axes and scale, large offsets, and many kinds of invalid files.
#include "core/scene/files/load_mesh.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>

#include "core/base/base64.hpp"
#include "core/base/memory_left.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/text/format.hpp"
#include "tests/core/scene/mesh_checks.hpp"
#include "tests/core/scene/temporary_files.hpp"
#include "tests/is_sanitized.hpp"

namespace sonar::load_mesh_test {
namespace {

using ::testing::HasSubstr;
using tests::expect_sound;
using tests::TemporaryFiles;

// A wedge: 2 long in x, 1 wide in y, 3 high in z.
const std::string obj = "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 3\nusemtl steel\nf 1 3 2\nf 1 2 4\nusemtl wood\nf 1 4 3\nf 2 3 4\n";
const std::string ply =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n2 0 0\n0 1 0\n0 0 3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
const std::string stl =
    "solid wedge\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 2 0 0\nendloop\nendfacet\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 0 3\nendloop\nendfacet\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 3\nvertex 0 1 0\nendloop\nendfacet\n"
    "facet normal 0 0 0\nouter loop\nvertex 2 0 0\nvertex 0 1 0\nvertex 0 0 3\nendloop\nendfacet\n"
    "endsolid wedge\n";

// The same wedge as binary STL. Its header begins like that of a text file.
std::string binary_stl() {
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

std::string collada(const std::string& axis) {
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
std::string glb(int nodes = 1) {
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

struct Extent {
  Vec3d low, high;
};
Extent extent(const CentredMesh& m) {
  Extent e{{1e30, 1e30, 1e30}, {-1e30, -1e30, -1e30}};
  for (const Vec3& v : m.mesh.vertices) {
    const Vec3d p = to_double(v) + m.centre_m;
    e.low = {std::min(e.low.x, p.x), std::min(e.low.y, p.y), std::min(e.low.z, p.z)};
    e.high = {std::max(e.high.x, p.x), std::max(e.high.y, p.y), std::max(e.high.z, p.z)};
  }
  return e;
}
void expect_extent(const LoadedMesh& m, Vec3d low, Vec3d high) {
  expect_sound(m.centred.mesh);
  EXPECT_EQ(m.centred.mesh.triangles.size(), 4u);
  EXPECT_EQ(m.centred.mesh.vertices.size(), 4u);
  const Extent e = extent(m.centred);
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
  TemporaryFiles files_;
};

TEST_F(LoadMesh, ZUpFormats) {
  expect_extent(good("a.obj", obj), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("a.stl", stl), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("b.stl", binary_stl()), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("a.ply", ply), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("A.OBJ", obj), {0, 0, 0}, {2, 1, 3});
}

TEST_F(LoadMesh, NodesThatShowTheSameMeshAreCountedBeforeTheyTakeMemory) {
  std::filesystem::create_directories(files_.path("proc"));
  files_.write("proc/meminfo", "MemAvailable: 5000 kB\n");
  memory_root() = files_.folder();
  const std::string refused = refusal("many.glb", glb(10000)), few = refusal("few.glb", glb(10));
  memory_root() = "/";
  EXPECT_THAT(refused, HasSubstr("many.glb would take about 5 MiB of memory, and 4 MiB are left"));
  EXPECT_EQ(few, "accepted");
}

TEST_F(LoadMesh, YUpFormatsAreTurned) {
  expect_extent(good("a.glb", glb()), {0, -3, 0}, {2, 0, 1});
  expect_extent(good("y.dae", collada("Y_UP")), {0, -3, 0}, {2, 0, 1});
  expect_extent(good("z.dae", collada("Z_UP")), {0, 0, 0}, {2, 1, 3});
}

TEST_F(LoadMesh, BinaryStlOnDiskIsWhatTheImporterMakesOfIt) {
  const std::string bytes = binary_stl();
  const LoadedMesh ours = good("b.stl", bytes);
  MeshFile held;
  held.file = "b.stl";
  held.in_memory = bytes;
  const auto theirs = load_mesh(held);
  ASSERT_TRUE(theirs);
  EXPECT_EQ(ours.centred.mesh, theirs->centred.mesh);
  EXPECT_EQ(ours.centred.centre_m.z, theirs->centred.centre_m.z);
  EXPECT_EQ(ours.material_names, theirs->material_names);
}

TEST_F(LoadMesh, BinaryStlThatEndsBeforeItsLastTriangleIsRefused) {
  const auto opened = open_regular(files_.write("b.stl", binary_stl()));
  ASSERT_TRUE(opened);
  std::size_t given = 0;
  const TriangleSink count = [&](std::span<const Vec3d, 3>, std::uint16_t) { ++given; };
  EXPECT_TRUE(each_triangle_of_binary_stl(opened->get(), 4, count));
  EXPECT_EQ(given, 4u);
  EXPECT_FALSE(each_triangle_of_binary_stl(opened->get(), 5, count));
}

TEST_F(LoadMesh, TrianglesThatChangeBetweenThePassesAreRefused) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  // Number of triangles in the second pass, and a coordinate of the last one.
  for (const auto& given : {std::pair{2, 1.0}, {1, 1.0}, {3, 1.0}, {2, nan}, {2, 9.0}}) {
    const int count = given.first;
    const double x = given.second;
    int pass = 0;
    const auto mesh = clean_triangles([&](const TriangleSink& take) {
      const bool second = pass++ > 0;
      const int n = second ? count : 2;
      for (int i = 0; i < n; ++i)
        take(std::array{Vec3d{0, 0, 0}, Vec3d{second && i + 1 == n ? x : 1.0, 0, 0}, Vec3d{0, 1, 0}}, 0);
    });
    if (count == 2 && x == 1.0) {
      EXPECT_TRUE(mesh);
    } else {
      ASSERT_FALSE(mesh) << count << " " << x;
      EXPECT_THAT(mesh.error().text, HasSubstr("changed while it was read"));
    }
  }
}

TEST_F(LoadMesh, UpAndScaleAsAsked) {
  MeshFile y_up;
  y_up.up = UpAxis::y;
  expect_extent(good("a.obj", obj, y_up), {0, -3, 0}, {2, 0, 1});
  expect_extent(good("z.dae", collada("Z_UP"), y_up), {0, -3, 0}, {2, 0, 1});
  MeshFile z_up;
  z_up.up = UpAxis::z;
  z_up.scale = 0.001;
  expect_extent(good("a.glb", glb(), z_up), {0, 0, 0}, {0.002, 0.001, 0.003});
  expect_extent(good("y.dae", collada("Y_UP"), z_up), {0, 0, 0}, {0.002, 0.001, 0.003});
}

TEST_F(LoadMesh, MaterialsKeepTheirNamesAndTriangles) {
  const LoadedMesh mesh = good("a.obj", obj);
  std::map<std::string, int> count;
  for (const std::uint16_t m : mesh.centred.mesh.material) ++count[mesh.material_names[m]];
  EXPECT_EQ(count["steel"] + count["wood"] + count["DefaultMaterial"], 4);
}

TEST_F(LoadMesh, VolumesKeepTheirSign) {
  EXPECT_NEAR(tests::volume(good("a.obj", obj).centred.mesh), 1, 1e-6);
  EXPECT_NEAR(tests::volume(good("a.glb", glb()).centred.mesh), 1, 1e-6);
}

TEST_F(LoadMesh, FarOffsetsMoveIntoTheCentre) {
  const LoadedMesh mesh = good("far.obj", "v 500000 0 0\nv 500002 0 0\nv 500000 1 0\nf 1 2 3\n");
  EXPECT_DOUBLE_EQ(mesh.centred.centre_m.x, 500001);
  for (const Vec3& v : mesh.centred.mesh.vertices) EXPECT_LE(std::abs(v.x), 1);
}

TEST_F(LoadMesh, TrianglesWithoutAreaAreLeftOutAndCounted) {
  const LoadedMesh mesh = good("d.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 2\n");
  EXPECT_EQ(mesh.centred.mesh.triangles.size(), 1u);
  EXPECT_GE(mesh.centred.left_out, 1u);
}

// A sonar needs only the vertices of a face. Texture coordinates and normals may be missing, or removed by a tool.
TEST_F(LoadMesh, ObjFacesThatNameMissingTextureCoordinatesAreRead) {
  const std::string left = "vn 0 0 1\no left\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n",
                    right = "v 2 0 0\nv 3 0 0\nv 3 1 0\nv 2 1 0\n";
  for (const char* face :
       {"5/1/1 6/2/1 7/3/1 8/4/1", "5/9 6/9 7/9 8/9", "5//7 6//8 7//9 8//9", "-4/-9/-9 -3/1/1 -2/1/1 -1/1/1",
        "5/1/1\t6/2/1 \\\n 7/3/1  8/4/1 ", "5/1/1 6/2/1 7/3/1 8/4/1\r", "5/1/1 6/2/1 7/3/1 8/4/1 # the right 1/2 of it"}) {
    const LoadedMesh mesh = good("partly.obj", left + "f 1//1 2//1 3//1 4//1\no right\n" + right + "f " + face + "\n");
    EXPECT_EQ(mesh.centred.mesh.triangles.size(), 4u) << face;
    EXPECT_EQ(mesh.lost, 0u) << face;
    EXPECT_NEAR(extent(mesh.centred).high.x, 3, 1e-6) << face;
  }
  const LoadedMesh whole = good("whole.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n");
  EXPECT_EQ(whole.centred.mesh.triangles.size(), 1u);
}

TEST_F(LoadMesh, ObjLinesMayBeginWithBlanksOrAByteOrderMark) {
  const std::string square = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\n";
  for (const std::string& text : {"\xEF\xBB\xBF" + square + "f 1 2 3 4\n", square + "f 1 2 3\n \tf 1 3 4\n",
                                  std::string(" v 0 0 0\r\n\tv 2 0 0\r\n v 2 1 0\r\n v 0 1 0\r\n f 1 2 \\\r\n 3 4\r\n")}) {
    const LoadedMesh mesh = good("m.obj", text);
    EXPECT_EQ(mesh.centred.mesh.triangles.size(), 2u) << text;
    EXPECT_EQ(mesh.lost, 0u) << text;
    EXPECT_NEAR(extent(mesh.centred).high.x - extent(mesh.centred).low.x, 2, 1e-6) << text;
  }
}

TEST_F(LoadMesh, BinaryStlMayHaveBytesBehindItsTriangles) {
  const auto binary = [](std::uint32_t triangles, std::size_t present, const std::string& behind) {
    std::string text(80, '\0');
    text.append(reinterpret_cast<const char*>(&triangles), 4);
    const std::array<float, 12> numbers{0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    for (std::size_t k = 0; k < present; ++k) text.append(reinterpret_cast<const char*>(numbers.data()), 48).append(2, '\0');
    return text + behind;
  };
  EXPECT_EQ(good("tail.stl", binary(2, 2, "made by hand")).lost, 0u);
  EXPECT_EQ(good("more.stl", binary(1, 3, "")).lost, 2u) << "which the header does not count";
  for (const std::string& text : {binary(3, 2, ""), binary(0, 0, ""), std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")})
    EXPECT_THAT(refusal("short.stl", text), HasSubstr("is not an STL file, or cut short"));
}

TEST_F(LoadMesh, PlyHeadersMayHaveCapitalsAndOtherLineEnds) {
  const std::size_t end = ply.find("end_header") + 11;
  const std::string head = ply.substr(0, end), body = ply.substr(end);
  const auto with_ends = [](std::string text, const std::string& line_end) {
    for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += line_end.size()) text.replace(at, 1, line_end);
    return text;
  };
  std::string binary;
  for (const std::array<float, 3>& v : {std::array{0.f, 0.f, 0.f}, {2.f, 0.f, 0.f}, {0.f, 1.f, 0.f}, {0.f, 0.f, 3.f}})
    binary.append(reinterpret_cast<const char*>(v.data()), sizeof v);
  for (const std::array<int, 3>& t : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}})
    binary.append(1, 3).append(reinterpret_cast<const char*>(t.data()), sizeof t);
  std::string binary_head = head;
  binary_head.replace(head.find("ascii"), 5, "binary_little_endian");
  for (const bool capitals : {false, true})
    for (const char* line_end : {"\n", "\r\n"}) {
      const auto shaped = [&](std::string text) {
        if (capitals)
          for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
        return with_ends(text, line_end);
      };
      expect_extent(good("t.ply", shaped(head) + with_ends(body, line_end)), {0, 0, 0}, {2, 1, 3});
      expect_extent(good("b.ply", shaped(binary_head) + binary), {0, 0, 0}, {2, 1, 3});
    }
}

TEST_F(LoadMesh, TextStlMayHaveCapitalsAndBlankLinesFirst) {
  std::string capitals = stl;
  for (char& c : capitals) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  for (const std::string& text : {capitals, "\n\r\n  " + stl, "\t" + capitals})
    expect_extent(good("t.stl", text), {0, 0, 0}, {2, 1, 3});
  EXPECT_THAT(refusal("cut.stl", binary_stl().substr(0, 200)),
              HasSubstr("is not an STL file, or cut short"));  // begins with "solid", too
  EXPECT_THAT(refusal("cut.stl", stl.substr(0, 60)),
              HasSubstr("ends within facet 1 (line 5); it is cut short or damaged, export it again"));
}

TEST_F(LoadMesh, OtherKindsOfFilesAreNamed) {
  EXPECT_THAT(refusal("a.obj", "<!DOCTYPE html>"), HasSubstr("a.obj: is a web page"));
  EXPECT_THAT(refusal("a.stl", "version https://git-lfs.github.com/spec/v1\n"), HasSubstr("git lfs pull"));
  EXPECT_THAT(refusal("a.ply",
                      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement tristrips 1\nproperty list int "
                      "int vertex_indices\nend_header\n0\n3 0 0 0\n"),
              HasSubstr("strips of triangles"));
}

TEST_F(LoadMesh, TrianglesThatAFileListsAndTheMeshHasNotAreCounted) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  EXPECT_EQ(good("whole.obj", corners + "f 1 2 3 4\n").lost, 0u);
  std::string beyond = ply;
  beyond.replace(beyond.rfind("3 1 2 3"), 7, "3 1 2 9");
  const LoadedMesh three = good("beyond.ply", beyond);
  EXPECT_EQ(three.centred.mesh.triangles.size(), 3u);
  EXPECT_EQ(three.lost, 1u);
  for (const char* bad : {"1 2 9", "1 2 0", "-5 2 3", "1 2/1/1 9/1/1", "1 2 \\\n 9", "1 2 99999999999999999999999"}) {
    const LoadedMesh good_ones = good("beyond.obj", corners + "f 1 2 3\nf " + bad + "\nf 1 3 4\n");
    EXPECT_EQ(good_ones.centred.mesh.triangles.size(), 2u) << bad;
    EXPECT_EQ(good_ones.lost, 1u) << bad;
  }
  EXPECT_EQ(good("before.obj", "f 1 2 3\nf 1 3 -1\n" + corners + "f -4 -3 -2\n").lost, 1u) << "vertices may follow their face";
  EXPECT_THAT(refusal("beyond.obj", corners + "f 1 2 9\n"), HasSubstr("no triangles"));
  EXPECT_EQ(good("d.obj", corners + "f 1 2 3\nf 1 1 2\n").lost, 0u) << "without area is another count";
  EXPECT_EQ(good("whole.stl", stl).lost, 0u);
  EXPECT_EQ(good("whole.ply", ply).lost, 0u);
  EXPECT_EQ(good("whole.glb", glb(3)).lost, 0u);
}

/// A glTF file of two squares at x = 0 and 2, its meshes 0 and 1. `rest` replaces the text that follows the parts.
std::string gltf(const std::string& nodes, const std::string& scenes, const std::string& rest = "",
                 const std::string& last_index = "3") {
  std::string data;
  for (const float x : {0.f, 2.f})
    for (const auto& [dx, y] : {std::pair{0.f, 0.f}, {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
      for (const float v : {x + dx, y, 0.f}) data.append(reinterpret_cast<const char*>(&v), 4);
  for (const std::string& last : {std::string("3"), last_index})
    for (const int k : {0, 1, 2, 0, 2, std::stoi(last)}) data += {static_cast<char>(k), 0};
  const std::string text = base64(std::as_bytes(std::span(data)));
  std::string views, accessors, meshes;
  for (const auto& [offset, length] : {std::pair{0, 48}, {48, 48}, {96, 12}, {108, 12}})
    views += (views.empty() ? "" : ",") + std::string(R"({"buffer":0,"byteOffset":)") + std::to_string(offset) +
             R"(,"byteLength":)" + std::to_string(length) + "}";
  for (int k = 0; k < 4; ++k)
    accessors += (k == 0 ? "" : ",") + std::string(R"({"bufferView":)") + std::to_string(k) + R"(,"componentType":)" +
                 (k < 2 ? R"(5126,"count":4,"type":"VEC3"})" : R"(5123,"count":6,"type":"SCALAR"})");
  for (int k = 0; k < 2; ++k)
    meshes += (k == 0 ? "" : ",") + std::string(R"({"primitives":[{"attributes":{"POSITION":)") + std::to_string(k) +
              R"(},"indices":)" + std::to_string(k + 2) + "}]}";
  return R"({"asset":{"version":"2.0"},"nodes":[)" + nodes + R"(],"scenes":[)" + scenes + R"(],"meshes":[)" + meshes +
         R"(],"accessors":[)" + accessors + R"(],"bufferViews":[)" + views +
         R"(],"buffers":[{"byteLength":120,"uri":"data:application/octet-stream;base64,)" + text + R"("}])" + rest + "}";
}

TEST_F(LoadMesh, TrianglesOutsideOfTheScenesOfGltfFilesAreCounted) {
  const auto counts = [&](const std::string& text) {
    const LoadedMesh mesh = good("a.gltf", text);
    return std::array<std::uint64_t, 3>{mesh.centred.mesh.triangles.size(), mesh.lost, mesh.hidden};
  };
  using Counts = std::array<std::uint64_t, 3>;
  const std::string two = R"({"mesh":0},{"mesh":1})";
  EXPECT_EQ(counts(gltf(two, R"({"nodes":[0,1]})")), (Counts{4, 0, 0}));
  EXPECT_EQ(counts(gltf(two, R"({"nodes":[0]})")), (Counts{2, 0, 2}));
  EXPECT_EQ(counts(gltf(R"({"mesh":0})", R"({"nodes":[0]})")), (Counts{2, 0, 2}));
  EXPECT_EQ(counts(gltf(two, R"({"nodes":[0]},{"nodes":[1]})", R"(,"scene":1)")), (Counts{2, 0, 2}));
  EXPECT_EQ(counts(gltf(R"({"children":[1,2]},{"mesh":0},{"mesh":0,"translation":[5,0,0]})", R"({"nodes":[0]})")),
            (Counts{4, 0, 2}));
  EXPECT_EQ(counts(gltf(two, R"({"nodes":[0,1]})", "", "9")), (Counts{3, 1, 0})) << "a vertex that is not there";
}

TEST_F(LoadMesh, GltfExtensionsThatMoveSurfacesAreRefusedByName) {
  const std::string two = R"({"mesh":0},{"mesh":1})", scene = R"({"nodes":[0,1]})";
  const auto with = [&](const char* list, const std::string& name) {
    return gltf(two, scene, std::string(",\"") + list + "\":[\"" + name + "\"]");
  };
  for (const std::string name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
    EXPECT_THAT(
        refusal("a.gltf", with("extensionsRequired", name)),
        HasSubstr("a.gltf: needs the extension " + name + ", which is not read; unpack it: gltf-transform copy IN OUT.glb"));
  EXPECT_THAT(refusal("a.gltf", with("extensionsRequired", "X_shapes")),
              HasSubstr("needs the extension X_shapes, which is not read; export it without"));
  EXPECT_THAT(refusal("a.gltf", with("extensionsUsed", "EXT_mesh_gpu_instancing")), HasSubstr("EXT_mesh_gpu_instancing"));
  for (const char* harmless : {"KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"})
    EXPECT_EQ(good("a.gltf", with("extensionsRequired", harmless)).centred.mesh.triangles.size(), 4u) << harmless;
  EXPECT_THAT(refusal("b.gltf", glb()), HasSubstr("is a GLB file; name it .glb"));
}

TEST_F(LoadMesh, GltfMorphTargetsThatMoveVerticesAreRefused) {
  const auto with_weights = [&](const std::string& weights) {
    return gltf(R"({"mesh":0,"weights":[)" + weights + "]}", R"({"nodes":[0]})");
  };
  for (const char* moved : {"0,1", "0.5", "-1"})
    EXPECT_THAT(refusal("a.gltf", with_weights(moved)), HasSubstr("is shaped by morph targets")) << moved;
  EXPECT_EQ(good("a.gltf", with_weights("0,0.0")).centred.mesh.triangles.size(), 2u);
}

/// A COLLADA file of a square whose corners follow one bone at `bone`. The node of the skin is at another position.
std::string skinned_collada(const std::string& bone) {
  const auto source = [](const char* id, const char* kind, int count, const std::string& values, int stride, const char* type) {
    return std::string("<source id='") + id + "'><" + kind + "_array id='" + id + "a' count='" + std::to_string(count) + "'>" +
           values + "</" + kind + "_array><technique_common><accessor source='#" + id + "a' count='" +
           std::to_string(count / stride) + "' stride='" + std::to_string(stride) + "'><param name='" +
           (stride == 3 ? "X" : "TRANSFORM") + "' type='" + type + "'/>" +
           (stride == 3 ? "<param name='Y' type='float'/><param name='Z' type='float'/>" : "") +
           "</accessor></technique_common></source>";
  };
  const std::string one = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
  return "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset><up_axis>Z_UP</up_axis></asset>"
         "<library_geometries><geometry id='g'><mesh>" +
         source("p", "float", 12, "0 0 0 1 0 0 1 1 0 0 1 0", 3, "float") +
         "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices><triangles count='2'><input semantic='VERTEX' "
         "source='#v' offset='0'/><p>0 1 2 0 2 3</p></triangles></mesh></geometry></library_geometries><library_controllers>"
         "<controller id='c'><skin source='#g'><bind_shape_matrix>" +
         one + "</bind_shape_matrix>" + source("j", "Name", 1, "bone", 1, "name") +
         source("i", "float", 16, one, 16, "float4x4") + source("w", "float", 1, "1", 1, "float") +
         "<joints><input semantic='JOINT' source='#j'/><input semantic='INV_BIND_MATRIX' source='#i'/></joints><vertex_weights "
         "count='4'><input semantic='JOINT' source='#j' offset='0'/><input semantic='WEIGHT' source='#w' offset='1'/><vcount>1 1 "
         "1 1</vcount><v>0 0 0 0 0 0 0 0</v></vertex_weights></skin></controller></library_controllers><library_visual_scenes>"
         "<visual_scene id='s'><node id='bone' sid='bone' type='JOINT'><translate>" +
         bone +
         "</translate></node><node><translate>100 0 0</translate><instance_controller url='#c'><skeleton>#bone</skeleton>"
         "</instance_controller></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url='#s'/></scene>"
         "</COLLADA>";
}

TEST_F(LoadMesh, SkinsFollowTheirBonesAtRest) {
  const Extent there = extent(good("a.dae", skinned_collada("0 7 -3")).centred);
  EXPECT_LT(length(there.low - Vec3d{0, 7, -3}), 1e-5) << there.low.x << " " << there.low.y << " " << there.low.z;
  EXPECT_LT(length(there.high - Vec3d{1, 8, -3}), 1e-5);
}

TEST_F(LoadMesh, TrianglesOutsideOfTheSceneOfACollada) {
  const auto changed = [](const std::string& from, const std::string& to) {
    std::string text = collada("Z_UP");
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_EQ(good("a.dae", collada("Z_UP")).hidden, 0u);
  EXPECT_EQ(good("a.dae", collada("Z_UP")).lost, 0u);
  const std::string second =
      "<geometry id=\"h\"><mesh><source id=\"hp\"><float_array id=\"ha\" count=\"9\">0 0 0 1 0 0 0 1 0</float_array>"
      "<technique_common><accessor source=\"#ha\" count=\"3\" stride=\"3\"><param name=\"X\" type=\"float\"/>"
      "<param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor></technique_common></source>"
      "<vertices id=\"hv\"><input semantic=\"POSITION\" source=\"#hp\"/></vertices><polylist count=\"1\"><input "
      "semantic=\"VERTEX\" source=\"#hv\" offset=\"0\"/><vcount>3</vcount><p>0 1 2</p></polylist></mesh></geometry>";
  const LoadedMesh unused = good("a.dae", changed("</library_geometries>", second + "</library_geometries>"));
  EXPECT_EQ(unused.centred.mesh.triangles.size(), 4u);
  EXPECT_EQ(unused.hidden, 1u);
  EXPECT_EQ(unused.lost, 0u);
  const LoadedMesh no_count = good("b.dae", [&] {
    std::string text = changed("</library_geometries>", second + "</library_geometries>");
    text.replace(text.find("<node>"), 6, "<node><instance_geometry url=\"#h\"/>");
    return text.replace(text.find("<triangles count=\"4\">"), 21, "<triangles>");
  }());
  EXPECT_EQ(no_count.centred.mesh.triangles.size(), 1u);
  EXPECT_EQ(no_count.lost, 4u) << "which the importer passes over";
  const LoadedMesh twice = good("c.dae", changed("<node>", "<node><instance_geometry url=\"#g\"/>"));
  EXPECT_EQ(twice.centred.mesh.triangles.size(), 8u);
  EXPECT_EQ(twice.lost + twice.hidden, 0u);
}

// Models of vehicles have this size: three of bluerov2_gz have more than 4 MiB.
TEST_F(LoadMesh, AColladaOfManyMebibytesIsRead) {
  constexpr int edge = 350;
  std::string places, corners;
  for (int k = 0; k < edge * edge; ++k) {
    places += text::format("%.9f %.9f %.9f ", 0.01 * (k % edge), 0.01 * (k / edge), 0.001 * (k % 7));
    const int right = k + 1, up = k + edge, both = up + 1;
    if (k % edge + 1 < edge && k / edge + 1 < edge) corners += text::format("%d %d %d %d %d %d ", k, right, both, k, both, up);
  }
  std::string whole = collada("Z_UP");
  const auto put = [&](const std::string& from, const std::string& to, const std::string& content) {
    const std::size_t at = whole.find(from) + from.size();
    whole.replace(at, whole.find(to, at) - at, content);
  };
  put("<p>", "</p>", corners);
  put("<triangles count=\"", "\"", std::to_string(2 * (edge - 1) * (edge - 1)));
  put("count=\"12\">", "</float_array>", places);
  put("<float_array id=\"a\" count=\"", "\"", std::to_string(3 * edge * edge));
  put("<accessor source=\"#a\" count=\"", "\"", std::to_string(edge * edge));
  ASSERT_GT(whole.size(), std::size_t{8} << 20);
  const LoadedMesh mesh = good("vehicle.dae", whole);
  EXPECT_EQ(mesh.centred.mesh.triangles.size(), 2u * (edge - 1) * (edge - 1));
  EXPECT_EQ(mesh.lost + mesh.hidden, 0u);
  EXPECT_NEAR(extent(mesh.centred).high.x, 0.01 * (edge - 1), 1e-6);
}

TEST_F(LoadMesh, FaultsOfAGlbAreNamed) {
  const std::string whole = glb();
  const auto with = [&](std::size_t at, char c) {
    std::string bent = whole;
    bent[at] = c;
    return bent;
  };
  std::string unpadded = whole;  // as older exporters write it
  const std::size_t json = static_cast<unsigned char>(whole[12]) + 256u * static_cast<unsigned char>(whole[13]);
  unpadded.insert(20 + json, " ");
  unpadded[12] = static_cast<char>(unpadded[12] + 1), unpadded[8] = static_cast<char>(unpadded[8] + 1);
  EXPECT_THAT(refusal("u.glb", unpadded), HasSubstr("u.glb: cannot be read: its JSON chunk has " + std::to_string(json + 1) +
                                                    " bytes, and GLB requires a multiple of 4"));
  EXPECT_THAT(refusal("l.glb", "version https://git-lfs.github.com/spec/v1\n"), HasSubstr("l.glb: is a pointer of Git LFS"));
  EXPECT_THAT(refusal("c.glb", whole.substr(0, whole.size() - 30)), HasSubstr("c.glb: cannot be read: is cut short"));
  EXPECT_THAT(refusal("v.glb", with(4, 3)), HasSubstr("v.glb: cannot be read: is GLB of version 3"));
  EXPECT_THAT(refusal("h.glb", whole.substr(0, 15)), HasSubstr("ends within its head"));
  EXPECT_THAT(refusal("a.glb", with(9, 0)), HasSubstr("its head announces "));
  EXPECT_THAT(refusal("j.glb", with(20, '[')), HasSubstr("j.glb: cannot be read: its JSON is damaged"));
  EXPECT_THAT(refusal("j.gltf", "{\"asset\":"), HasSubstr("j.gltf: cannot be read: its JSON is damaged"));
  for (const std::string asset : {R"({"version":"4.0"})", "{}"})
    EXPECT_THAT(refusal("v.gltf", R"({"asset":)" + asset + "}"), HasSubstr("is no valid glTF of version 1 or 2")) << asset;
  std::string alone = whole.substr(0, 20 + json);
  alone[8] = static_cast<char>((20 + json) & 0xFF), alone[9] = static_cast<char>((20 + json) >> 8);
  EXPECT_THAT(refusal("b.glb", alone), HasSubstr("b.glb: cannot be read: has no binary chunk"));
}

TEST_F(LoadMesh, WrongFilesAreRefusedWithOneSentence) {
  EXPECT_THAT(refusal("n.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"), HasSubstr("n.obj: has vertices that are not finite"));
  EXPECT_THAT(refusal("h.obj", "v 0 0 0\nv 2e7 0 0\nv 0 1 0\nf 1 2 3\n"),
              HasSubstr("h.obj: reaches beyond 1e7 m; set \"scale\""));
  EXPECT_THAT(refusal("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
              HasSubstr("flat.obj: has only triangles without area"));
  EXPECT_THAT(refusal("x.xyz", "1 2 3"), HasSubstr("x.xyz: unknown mesh format; use OBJ"));
  EXPECT_THAT(refusal("x.fbx", "Kaydara"), HasSubstr("assimp export IN OUT.glb"));
  EXPECT_THAT(refusal("x.laz", "LASF"), HasSubstr("x.laz: is a cloud of points, not a surface"));
  EXPECT_THAT(
      refusal("c.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\ncstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nend\n"),
      HasSubstr("c.obj: has 1 curved surface(s) (surf), which are not read; export polygons"));
  EXPECT_EQ(refusal("s.obj", "o surf 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\ng surf \nusemtl surf x\n# surf 1\nf 1 2 3\n"), "accepted");
  for (const char* name : {"e.obj", "e.stl", "e.ply", "e.glb", "e.gltf", "e.dae"}) {
    EXPECT_THAT(refusal(name, ""), HasSubstr(std::string(name) + ": ")) << name;
    EXPECT_THAT(refusal(name, "this is not a mesh"), HasSubstr(std::string(name) + ": ")) << name;
  }
  EXPECT_NE(refusal("points.obj", "v 0 0 0\nv 1 0 0\n"), "accepted");
  MeshFile missing;
  missing.file = files_.path("none.obj");
  const auto error = load_mesh(missing);
  ASSERT_FALSE(error);
  EXPECT_EQ(error.error().kind, ErrorKind::missing_file);
  EXPECT_THAT(error.error().text, HasSubstr("no mesh file at "));
}

TEST_F(LoadMesh, TruncatedFilesNeverCrash) {
  const std::pair<const char*, std::string> all[] = {{"t.obj", obj}, {"t.stl", stl},   {"b.stl", binary_stl()},
                                                     {"t.ply", ply}, {"t.glb", glb()}, {"t.dae", collada("Z_UP")}};
  constexpr std::size_t step = test::is_sanitized ? 35 : 7;  // under sanitizers mesh_file_fuzz damages more of them
  for (const auto& [name, bytes] : all) {
    for (std::size_t n = 0; n < bytes.size(); n += step) {
      MeshFile request;
      request.file = files_.write(name, bytes.substr(0, n));
      const auto mesh = load_mesh(request);
      if (mesh) {
        expect_sound(mesh->centred.mesh);
      } else {
        EXPECT_THAT(mesh.error().text, HasSubstr(name));
      }
    }
  }
}

TEST(CleanMesh, Limits) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(clean_mesh({}, {}).error().text, HasSubstr("has no triangles"));
  EXPECT_THAT(clean_mesh({{0, 0, 0}, {1, 0, nan}, {0, 1, 0}}, {}).error().text, HasSubstr("not finite"));
  EXPECT_THAT(clean_mesh(std::vector<Vec3d>(30), {}, 9).error().text, HasSubstr("has more than 9 triangles; simplify it"));
}

}  // namespace
}  // namespace sonar::load_mesh_test
