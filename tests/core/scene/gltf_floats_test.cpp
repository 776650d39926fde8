// glTF files whose vertices are whole numbers (KHR_mesh_quantization), in every form and container.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/base/base64.hpp"
#include "core/scene/files/load_mesh.hpp"
#include "core/scene/import/gltf_floats.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::gltf_floats_test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using tests::TemporaryFiles;

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size()};
}
/// Returns three corners, with further bytes between them.
template <class T>
std::string corners(const std::array<T, 9>& xyz, std::size_t stride) {
  std::string bytes(3 * stride, '\x55');
  for (std::size_t v = 0; v < 3; ++v) std::memcpy(bytes.data() + v * stride, xyz.data() + 3 * v, 3 * sizeof(T));
  return bytes;
}

/// A triangle whose positions have this type, after two bytes of a header in their view, in buffer 0.
struct Triangle {
  json description;
  std::string data;

  Triangle(int type, bool normalized, const std::string& positions, std::size_t stride) : data("??" + positions) {
    description = {{"asset", {{"version", "2.0"}}},
                   {"extensionsRequired", {"KHR_mesh_quantization"}},
                   {"scene", 0},
                   {"scenes", {{{"nodes", {0}}}}},
                   {"nodes", {{{"mesh", 0}}}},
                   {"materials", {{{"name", "rust"}, {"normalTexture", {{"index", 7}}}}}},
                   {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}, {"NORMAL", 9}}}, {"material", 0}}}}}}},
                   {"accessors",
                    {{{"bufferView", 0},
                      {"byteOffset", 2},
                      {"componentType", type},
                      {"count", 3},
                      {"type", "VEC3"},
                      {"normalized", normalized}}}},
                   {"bufferViews", {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", data.size()}, {"byteStride", stride}}}},
                   {"buffers", {{{"byteLength", data.size()}}}}};
  }
  std::string embedded() const {
    json all = description;
    all["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(std::as_bytes(std::span(data)));
    return all.dump();
  }
  std::string beside(const std::string& name) const {
    json all = description;
    all["buffers"][0]["uri"] = name;
    return all.dump();
  }
  std::string glb() const {
    const auto word = [](std::size_t v) { return bytes_of(std::vector<std::uint32_t>{static_cast<std::uint32_t>(v)}); };
    std::string text = description.dump(), binary = data;
    text.resize((text.size() + 3) / 4 * 4, ' '), binary.resize((binary.size() + 3) / 4 * 4);
    return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text + word(binary.size()) +
           std::string("BIN\0", 4) + binary;
  }
};

struct GltfFloats : ::testing::Test {
  TemporaryFiles files;

  /// Returns the vertices of the triangle, in the axes of the file.
  std::vector<Vec3d> vertices(const std::string& name, const std::string& bytes) {
    const auto mesh = load_mesh({.file = files.write(name, bytes)});
    if (!mesh) {
      ADD_FAILURE() << mesh.error().text;
      return {{}, {}, {}};
    }
    EXPECT_EQ(mesh->lost, 0u);
    EXPECT_EQ(mesh->material_names.at(mesh->centred.mesh.material.at(0)), "rust");
    std::vector<Vec3d> all;
    for (const Vec3& v : mesh->centred.mesh.vertices) {
      const Vec3d p = to_double(v) + mesh->centred.centre_m;
      all.push_back({p.x, p.z, -p.y});
    }
    all.resize(3);
    return all;
  }
  void expect_vertices(const std::vector<Vec3d>& are, const std::vector<Vec3d>& wanted) {
    for (const Vec3d& v : wanted) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Vec3d& a : are) nearest = std::min(nearest, length(a - v));
      EXPECT_LT(nearest, 1e-6) << v.x << ' ' << v.y << ' ' << v.z;
    }
  }
  std::string refusal(const std::string& bytes) {
    const auto mesh = load_mesh({.file = files.write("bad.gltf", bytes)});
    return mesh ? "accepted" : mesh.error().text;
  }
};

TEST_F(GltfFloats, EveryTypeOfNumberIsRead) {
  const auto read = [&](int type, bool normalized, const std::string& positions, std::size_t stride) {
    return vertices("a.gltf", Triangle(type, normalized, positions, stride).embedded());
  };
  expect_vertices(read(5120, false, corners<std::int8_t>({-128, 0, 0, 127, 0, 0, 0, 5, -7}, 4), 4),
                  {{-128, 0, 0}, {127, 0, 0}, {0, 5, -7}});
  expect_vertices(read(5120, true, corners<std::int8_t>({-128, 0, 0, 127, 0, 0, 0, -127, 0}, 4), 4),
                  {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}});
  expect_vertices(read(5121, false, corners<std::uint8_t>({0, 0, 0, 255, 0, 0, 0, 200, 3}, 8), 8),
                  {{0, 0, 0}, {255, 0, 0}, {0, 200, 3}});
  expect_vertices(read(5121, true, corners<std::uint8_t>({0, 0, 0, 255, 0, 0, 0, 51, 0}, 4), 4),
                  {{0, 0, 0}, {1, 0, 0}, {0, 0.2, 0}});
  expect_vertices(read(5122, false, corners<std::int16_t>({-32768, 0, 0, 32767, 0, 0, 0, -3, 2}, 8), 8),
                  {{-32768, 0, 0}, {32767, 0, 0}, {0, -3, 2}});
  expect_vertices(read(5122, true, corners<std::int16_t>({-32768, 0, 0, 32767, 0, 0, 0, 16384, 0}, 8), 8),
                  {{-1, 0, 0}, {1, 0, 0}, {0, 16384. / 32767, 0}});
  expect_vertices(read(5123, false, corners<std::uint16_t>({0, 0, 0, 65535, 0, 0, 0, 40000, 9}, 12), 12),
                  {{0, 0, 0}, {65535, 0, 0}, {0, 40000, 9}});
  expect_vertices(read(5123, true, corners<std::uint16_t>({0, 0, 0, 65535, 0, 0, 0, 13107, 0}, 8), 8),
                  {{0, 0, 0}, {1, 0, 0}, {0, 0.2, 0}});
}

const std::string shorts = corners<std::int16_t>({0, 0, 0, 100, 0, 0, 0, 50, 25}, 8);
const std::vector<Vec3d> of_shorts{{0, 0, 0}, {100, 0, 0}, {0, 50, 25}};

TEST_F(GltfFloats, EveryContainerIsRead) {
  const Triangle triangle(5122, false, shorts, 8);
  expect_vertices(vertices("a.gltf", triangle.embedded()), of_shorts);
  expect_vertices(vertices("a.glb", triangle.glb()), of_shorts);
  files.write("a b.bin", triangle.data);
  expect_vertices(vertices("b.gltf", triangle.beside("a b.bin")), of_shorts);
  expect_vertices(vertices("c.gltf", triangle.beside("a%20b.bin")), of_shorts);
  Triangle of_floats(5126, false, corners<float>({0, 0, 0, 100, 0, 0, 0, 50, 25}, 12), 12);
  of_floats.description["materials"] = {{{"name", "rust"}}};
  of_floats.description["meshes"][0]["primitives"][0]["attributes"].erase("NORMAL");
  files.write("f b.bin", of_floats.data);
  expect_vertices(vertices("d.gltf", of_floats.beside("f%20b.bin")), of_shorts);  // read by the importer itself
  EXPECT_EQ(without_percents("a%20b%00c%2"), "a b%00c%2");
  const std::string bytes = triangle.glb();
  const auto held = load_mesh({.file = "held.glb", .in_memory = bytes});
  ASSERT_TRUE(held) << held.error().text;
  EXPECT_EQ(held->centred.mesh.triangles.size(), 1u);
}

TEST_F(GltfFloats, NodesGiveTheSize) {
  Triangle triangle(5122, true, corners<std::int16_t>({0, 0, 0, 32767, 0, 0, 0, 32767, 0}, 8), 8);
  triangle.description["nodes"][0]["scale"] = {4, 2, 1};
  triangle.description["nodes"][0]["translation"] = {10, 20, 30};
  expect_vertices(vertices("a.glb", triangle.glb()), {{10, 20, 30}, {14, 20, 30}, {10, 22, 30}});
}

TEST_F(GltfFloats, WeightsOfBonesAreRead) {
  Triangle triangle(5126, false, bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}), 12);
  const std::size_t joints_at = triangle.data.size(), weights_at = joints_at + 12;
  triangle.data += std::string(12, '\0');
  for (int v = 0; v < 3; ++v) triangle.data += std::string("\xFF\0\0\0", 4);
  json& d = triangle.description;
  d["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", joints_at}, {"byteLength", 12}});
  d["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", weights_at}, {"byteLength", 12}});
  d["accessors"].push_back({{"bufferView", 1}, {"componentType", 5121}, {"count", 3}, {"type", "VEC4"}});
  d["accessors"].push_back({{"bufferView", 2}, {"componentType", 5121}, {"count", 3}, {"type", "VEC4"}, {"normalized", true}});
  d["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", triangle.data.size()}, {"byteLength", 64}});
  d["accessors"].push_back({{"bufferView", 3}, {"componentType", 5126}, {"count", 1}, {"type", "MAT4"}});
  triangle.data += bytes_of(std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  d["buffers"][0]["byteLength"] = triangle.data.size();
  d["meshes"][0]["primitives"][0]["attributes"] = {{"POSITION", 0}, {"JOINTS_0", 1}, {"WEIGHTS_0", 2}};
  d["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"name", "skinned"}}, {{"translation", {5, 6, 7}}, {"name", "bone"}}};
  d["scenes"][0]["nodes"] = {0, 1};
  d["skins"] = {{{"joints", {1}}, {"inverseBindMatrices", 3}}};
  expect_vertices(vertices("a.glb", triangle.glb()), {{5, 6, 7}, {6, 6, 7}, {5, 7, 7}});
  d["skins"][0].erase("inverseBindMatrices");  // the matrices are then unit matrices
  expect_vertices(vertices("a.glb", triangle.glb()), {{5, 6, 7}, {6, 6, 7}, {5, 7, 7}});
  d["skins"][0]["inverseBindMatrices"] = nullptr;
  expect_vertices(vertices("a.glb", triangle.glb()), {{5, 6, 7}, {6, 6, 7}, {5, 7, 7}});
  d["meshes"][0]["primitives"][0]["attributes"] = {{"POSITION", 0}};
  d["nodes"][0]["translation"] = {1, 2, 3};
  expect_vertices(vertices("a.glb", triangle.glb()), {{1, 2, 3}, {2, 2, 3}, {1, 3, 3}});
}

TEST_F(GltfFloats, DamagedFilesAreRefused) {
  const auto with = [](const auto& change) {
    Triangle triangle(5122, false, shorts, 8);
    change(triangle.description);
    return triangle.embedded();
  };
  EXPECT_EQ(refusal(with([](json&) {})), "accepted");
  const char* const beyond = "has vertices beyond the end of their data (accessor 0); fetch or export it again";
  EXPECT_THAT(refusal(with([](json& d) { d["accessors"][0]["count"] = 4; })), HasSubstr(beyond));
  EXPECT_THAT(refusal(with([](json& d) { d["accessors"][0]["count"] = std::uint64_t{1} << 62; })), HasSubstr(beyond));
  EXPECT_THAT(refusal(with([](json& d) { d["accessors"][0]["byteOffset"] = std::uint64_t(-2); })), HasSubstr(beyond));
  EXPECT_THAT(refusal(with([](json& d) { d["bufferViews"][0]["byteLength"] = 1000; })), HasSubstr(beyond));
  EXPECT_THAT(refusal(with([](json& d) { d["bufferViews"][0]["byteOffset"] = std::uint64_t(-8); })), HasSubstr(beyond));
  EXPECT_THAT(refusal(with([](json& d) { d["bufferViews"][0]["byteStride"] = 4; })), HasSubstr(beyond));
  EXPECT_THAT(refusal(with([](json& d) { d["bufferViews"][0]["buffer"] = 1; })), HasSubstr(beyond));
  EXPECT_THAT(refusal(with([](json& d) { d["accessors"][0]["bufferView"] = 3; })),
              HasSubstr("in a form that glTF does not have"));
  EXPECT_THAT(refusal(with([](json& d) { d["accessors"][0]["componentType"] = 5130; })), HasSubstr("a form that glTF does not"));
  EXPECT_THAT(refusal(with([](json& d) { d["accessors"][0]["type"] = "VEC2"; })), HasSubstr("a form that glTF does not have"));
  EXPECT_THAT(refusal(with([](json& d) {
                d["accessors"][0]["sparse"] = {{"count", 1}};
              })),
              HasSubstr("sparse vertices that are whole numbers (accessor 0), which are not read; convert it: gltf-transform"));
  const Triangle triangle(5122, false, shorts, 8);
  EXPECT_THAT(refusal(triangle.beside("no.bin")), HasSubstr("names the file no.bin, which cannot be read"));
  EXPECT_THAT(refusal(triangle.beside("../no.bin")), HasSubstr("outside of its folder"));
  EXPECT_THAT(refusal(triangle.beside("data:;base64,*")), HasSubstr("has a buffer (0) that is not base64"));
}

TEST_F(GltfFloats, DracoIsReadOrTheErrorNamesTheCommandToUnpack) {
  // Two triangles, 4 m by 2 m, one corner 1 m high, from gltf-transform 4.5.1: positions are rounded to 14 bits.
  const json extension{{"KHR_draco_mesh_compression", {{"bufferView", 0}, {"attributes", {{"POSITION", 0}}}}}};
  json file = Triangle(5126, false, "", 0).description;
  file["extensionsUsed"] = file["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  file["meshes"][0]["primitives"][0] = {{"attributes", {{"POSITION", 1}}}, {"indices", 0}, {"extensions", extension}};
  file["accessors"] = {{{"type", "SCALAR"}, {"componentType", 5123}, {"count", 6}},
                       {{"type", "VEC3"}, {"componentType", 5126}, {"count", 4}, {"min", {0, 0, 0}}, {"max", {4, 2, 1}}}};
  file["bufferViews"] = {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", 91}}};
  file["buffers"] = {{{"byteLength", 92},
                      {"uri",
                       "data:application/octet-stream;base64,RFJBQ08CAgEBAAAABAIAAgAAAR//AREB/wAAAQAJAwAAAgEBAQAPAwEQLwEwAwAo"
                       "ggDA/w8ABAD/PwAAAPz/ACAAAAAAAP8/AAAAAAAAAAAAAAAAAAAAAIBADgA="}}};
  const auto mesh = load_mesh({.file = files.write("d.gltf", file.dump())});
  if (mesh) {
    EXPECT_EQ(mesh->centred.mesh.triangles.size(), 2u);
    Vec3d most;
    for (const Vec3& v : mesh->centred.mesh.vertices) {
      const Vec3d p = to_double(v) + mesh->centred.centre_m;
      most = {std::max(most.x, p.x), std::max(most.y, -p.y), std::max(most.z, p.z)};
    }
    EXPECT_LT(length(most - Vec3d{4, 1, 2}), 1e-3) << most.x << ' ' << most.y << ' ' << most.z;
  } else {  // an Assimp without Draco
    EXPECT_THAT(mesh.error().text, HasSubstr("(KHR_draco_mesh_compression); unpack it: gltf-transform copy IN OUT.glb"));
  }
  file["accessors"][1]["componentType"] = 5123;
  EXPECT_THAT(refusal(file.dump()), HasSubstr("vertices that are compressed (KHR_draco_mesh_compression)"));
}

/// The indices are after the positions in the same buffer, whose end is missing.
TEST_F(GltfFloats, FilesThatAreCutWithinTheirIndicesAreRefused) {
  Triangle whole(5122, false, shorts, 8);
  const std::size_t begin = whole.data.size();
  whole.data += bytes_of(std::vector<std::uint16_t>{0, 1, 2});
  whole.description["buffers"][0]["byteLength"] = whole.data.size();
  whole.description["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", 6}});
  whole.description["accessors"].push_back({{"bufferView", 1}, {"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}});
  whole.description["meshes"][0]["primitives"][0]["indices"] = 1;
  const auto cut = [&](std::size_t missing, bool says_so) {
    Triangle file = whole;
    file.data.resize(whole.data.size() - missing);
    if (!says_so) file.description["buffers"][0]["byteLength"] = file.data.size();
    return load_mesh({.file = files.write("cut.gltf", file.embedded())});
  };
  ASSERT_TRUE(cut(0, true)) << cut(0, true).error().text;
  for (const std::size_t missing : {1u, 3u, 6u}) {
    EXPECT_THAT(cut(missing, true).error().text, HasSubstr("has a buffer (0) that is cut short"));
    EXPECT_FALSE(cut(missing, false)) << missing;
  }
}

/// The sizes in the header of the result have 32 bits.
TEST_F(GltfFloats, AResultThatIsTooLargeIsRefused) {
  const Triangle triangle(5122, false, shorts, 8);
  const auto rewritten = [&](std::uint64_t most_bytes) {
    return gltf_with_floats(
        triangle.glb(), [](const std::string&) { return std::nullopt; }, most_bytes);
  };
  const auto whole = rewritten(std::numeric_limits<std::uint32_t>::max());
  ASSERT_TRUE(whole);
  EXPECT_EQ(*rewritten(whole->size() + 6), *whole);
  for (const std::size_t most : {whole->size() - 1, whole->size() / 2, std::size_t{50}, std::size_t{10}}) {
    const auto refused = rewritten(most);
    ASSERT_FALSE(refused) << most;
    EXPECT_EQ(refused.error().text, "has vertices that take more than " + std::to_string(most) +
                                        " bytes as floating-point numbers; split it into several files");
  }
}

TEST_F(GltfFloats, MembersOfOtherTypesCauseNoCrash) {
  const Triangle triangle(5122, false, shorts, 8);
  const auto rewritten = [](const json& description, const std::string& data) {
    Triangle changed(5122, false, shorts, 8);
    changed.description = description, changed.data = data;
    return gltf_with_floats(changed.glb(), [](const std::string&) { return std::nullopt; }).has_value();
  };
  EXPECT_TRUE(rewritten(triangle.description, triangle.data));
  EXPECT_FALSE(rewritten(triangle.description, ""));
  const json flat = triangle.description.flatten();
  int kept = 0;
  for (const char* other : {"null", "-1", "7", "1e300", "\"x\"", "[]", "{}", "[[]]", "[null]", "true"})
    for (const auto& [path, value] : flat.items())
      for (json::json_pointer at(path); !at.empty(); at = at.parent_pointer()) {
        json changed = triangle.description;
        changed[at] = json::parse(other);
        kept += rewritten(changed, triangle.data);
      }
  EXPECT_GT(kept, 0);
}

}  // namespace
}  // namespace sonar::gltf_floats_test
