// Mesh files: all formats, axes and scale, large offsets, and many kinds of invalid files.
#include <array>
#include <limits>
#include <map>

#include "core/base/regular_file.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "tests/core/scene/load_mesh_testing.hpp"
#include "tests/is_sanitized.hpp"

namespace sonar::load_mesh_test {
namespace {

using namespace load_mesh_testing;
using ::testing::HasSubstr;

TEST_F(LoadMesh, ZUpFormatsStayAsTheyAre) {
  expect_extent(good("a.obj", obj), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("a.stl", stl), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("b.stl", binary_stl()), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("a.ply", ply), {0, 0, 0}, {2, 1, 3});
  expect_extent(good("A.OBJ", obj), {0, 0, 0}, {2, 1, 3});
}

TEST_F(LoadMesh, YUpFormatsAreTurned) {
  expect_extent(good("a.glb", glb()), {0, -3, 0}, {2, 0, 1});
  expect_extent(good("y.dae", collada("Y_UP")), {0, -3, 0}, {2, 0, 1});
  expect_extent(good("z.dae", collada("Z_UP")), {0, 0, 0}, {2, 1, 3});
}

TEST_F(LoadMesh, BinaryStlGivesTheSameMeshAsTheImporter) {
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

TEST_F(LoadMesh, UpAndScaleCanBeSet) {
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

TEST_F(LoadMesh, BinaryStlMayHaveBytesAfterItsTriangles) {
  const auto binary = [](std::uint32_t triangles, std::size_t present, const std::string& behind) {
    std::string text(80, '\0');
    text.append(reinterpret_cast<const char*>(&triangles), 4);
    const std::array<float, 12> numbers{0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    for (std::size_t k = 0; k < present; ++k) text.append(reinterpret_cast<const char*>(numbers.data()), 48).append(2, '\0');
    return text + behind;
  };
  EXPECT_EQ(good("tail.stl", binary(2, 2, "made by hand")).lost, 0u);
  EXPECT_EQ(good("more.stl", binary(1, 3, "")).lost, 2u) << "triangles that the header does not count";
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
  EXPECT_EQ(good("d.obj", corners + "f 1 2 3\nf 1 1 2\n").lost, 0u) << "triangles without area are counted separately";
  EXPECT_EQ(good("whole.stl", stl).lost, 0u);
  EXPECT_EQ(good("whole.ply", ply).lost, 0u);
  EXPECT_EQ(good("whole.glb", glb(3)).lost, 0u);
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
  EXPECT_THAT(refusal("b.glb", alone),
              ::testing::AllOf(HasSubstr("b.glb: cannot be read: has no binary chunk behind its JSON (byte "),
                               HasSubstr("where a GLB keeps its vertices; export it again as one .glb")));
}

TEST_F(LoadMesh, WrongFilesAreRefusedWithOneLine) {
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
        tests::expect_sound(mesh->centred.mesh);
      } else {
        EXPECT_THAT(mesh.error().text, HasSubstr(name));
      }
    }
  }
}

TEST(CleanMesh, RefusesEmptyNonFiniteAndTooLargeMeshes) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(clean_mesh({}, {}).error().text, HasSubstr("has no triangles"));
  EXPECT_THAT(clean_mesh({{0, 0, 0}, {1, 0, nan}, {0, 1, 0}}, {}).error().text, HasSubstr("not finite"));
  EXPECT_THAT(clean_mesh(std::vector<Vec3d>(30), {}, 9).error().text, HasSubstr("has more than 9 triangles; simplify it"));
}

}  // namespace
}  // namespace sonar::load_mesh_test
