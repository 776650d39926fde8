// Mesh files with nodes, scenes and extensions: glTF, GLB and COLLADA.
#include <array>
#include <filesystem>

#include "core/base/base64.hpp"
#include "core/base/memory_left.hpp"
#include "core/text/format.hpp"
#include "tests/core/scene/load_mesh_testing.hpp"

namespace sonar::load_mesh_nodes_test {
namespace {

using namespace load_mesh_testing;
using ::testing::HasSubstr;

TEST_F(LoadMesh, NodesThatShowTheSameMeshAreCountedBeforeTheyTakeMemory) {
  std::filesystem::create_directories(files_.path("proc"));
  files_.write("proc/meminfo", "MemAvailable: 5000 kB\n");
  memory_root() = files_.folder();
  const std::string refused = refusal("many.glb", glb(10000)), few = refusal("few.glb", glb(10));
  memory_root() = "/";
  EXPECT_THAT(refused, HasSubstr("many.glb would take about 5 MiB of memory, and 4 MiB are left"));
  EXPECT_EQ(few, "accepted");
}

/// Returns a glTF file of two squares at x = 0 and 2, its meshes 0 and 1. `rest` replaces the text that follows the parts.
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
  EXPECT_EQ(counts(gltf(two, R"({"nodes":[0,1]})", "", "9")), (Counts{3, 1, 0})) << "a face with a vertex that does not exist";
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

/// Returns a COLLADA file of a square whose corners follow one bone at `bone`. The node of the skin is at another position.
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
  const Corners there = extent(good("a.dae", skinned_collada("0 7 -3")).centred);
  EXPECT_LT(length(there.low - Vec3d{0, 7, -3}), 1e-5) << there.low.x << " " << there.low.y << " " << there.low.z;
  EXPECT_LT(length(there.high - Vec3d{1, 8, -3}), 1e-5);
}

TEST_F(LoadMesh, TrianglesOutsideOfTheSceneOfAColladaAreCounted) {
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
  EXPECT_THAT(refusal("none.dae", changed("<instance_visual_scene url=\"#s\"/>", "")), HasSubstr("none.dae: shows no scene"));
  EXPECT_THAT(refusal("other.dae", changed("url=\"#s\"", "url=\"#t\"")),
              HasSubstr("shows the scene \"t\", which is not in the file"));
  EXPECT_THAT(refusal("empty.dae", ""), HasSubstr("empty.dae: shows no scene"));
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

}  // namespace
}  // namespace sonar::load_mesh_nodes_test
