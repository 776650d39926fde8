// The scene format: its meaning, the error text for each invalid scene, and no mutation of a scene can crash the loader.
#include "core/scene/files/load_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/scene/files/shape_cache.hpp"
#include "tests/core/scene/mesh_checks.hpp"
#include "tests/core/scene/scene_testing.hpp"
#include "tests/core/scene/temporary_files.hpp"
#include "tests/is_sanitized.hpp"

namespace sonar {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using tests::TemporaryFiles;

std::string refusal(const std::string& text, const std::filesystem::path& folder = ".") {
  const auto scene = parse_scene(text, "s.yaml", folder);
  return scene ? "accepted" : scene.error().text;
}
std::shared_ptr<const Scene> parsed(const std::string& text, const std::filesystem::path& folder = ".") {
  auto scene = parse_scene(text, "s.yaml", folder);
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}
std::string object(const std::string& keys) { return "objects:\n  - {" + keys + "}\n"; }

TEST(LoadScene, EveryPrimitiveLoads) {
  const auto scene = parsed(R"(
name: all
objects:
  - {type: plane, material: sand, size_m: [4, 4]}
  - {type: box, material: rock, size_m: [1, 2, 3]}
  - {type: sphere, material: steel, radius_m: 0.5}
  - {type: cylinder, material: steel, radius_m: 0.5, length_m: 2, segments: 24, caps: bottom}
  - {type: capsule, material: steel, radius_m: 0.5, length_m: 2}
  - {type: cone, material: rubber, radius_m: 0.5, length_m: 1, top_radius_m: 0.1}
  - {type: torus, material: rubber, radius_m: 0.5, tube_radius_m: 0.1}
  - {type: rock, material: rock, size_m: [1, 1, 0.6], seed: 4}
  - {type: seabed, material: mud, size_m: [10, 10], spacing_m: 0.5, ripples: {wavelength_m: 2, height_m: 0.1}}
  - {type: point, target_strength_db: -20, pose: {xyz_m: [1, 2, 3]}}
sea_surface: {size_m: [50, 60], lambert_db: -35}
)");
  EXPECT_EQ(scene->name, "all");
  ASSERT_EQ(scene->objects.size(), 10u);
  EXPECT_EQ(scene->objects[1].name, "box 2");
  for (const Object& o : scene->objects) {
    tests::expect_sound(*o.mesh);
    for (const std::uint16_t m : o.mesh->material) ASSERT_LT(m, scene->materials.size());
  }
  ASSERT_EQ(scene->point_targets.size(), 1u);
  EXPECT_EQ(scene->point_targets[0].target_strength_db, -20);
  EXPECT_EQ(scene->point_targets[0].position_m.z, 3);
  EXPECT_TRUE(scene->sea_surface.present);
  EXPECT_EQ(scene->sea_surface.lambert_db, -35);
  EXPECT_EQ(scene->objects.back().name, "sea surface");
  EXPECT_EQ(scene->materials[scene->objects.back().mesh->material[0]].reflection, -1);
}

TEST(LoadScene, MaterialsComeFromTheLibraryAndTheScene) {
  const auto scene = parsed(R"(
materials:
  sand: {lambert_db: -20, roughness_m: 0.002, reflection: 0.4, texture_seed: 9}
  silt: {like: sand, lambert_db: -29}
objects:
  - {type: sphere, radius_m: 1, material: silt}
  - {type: sphere, radius_m: 1, material: concrete}
  - {type: sphere, radius_m: 2, material: silt}
)");
  ASSERT_EQ(scene->materials.size(), 2u);  // only the materials in use
  EXPECT_EQ(scene->materials[0].name, "silt");
  EXPECT_FLOAT_EQ(scene->materials[0].lambert_db, -29);
  EXPECT_FLOAT_EQ(scene->materials[0].roughness_m, 0.002f);
  EXPECT_EQ(scene->materials[0].texture_seed, 9u);
  EXPECT_EQ(scene->materials[1].name, "concrete");
  EXPECT_EQ(scene->objects[2].mesh->material[0], 0);
}

TEST(LoadScene, TheLibraryHasTheNamesWePromise) {
  for (const char* name :
       {"mud", "sand", "gravel", "rock", "concrete", "steel", "aluminium", "wood", "rubber", "plastic", "glass", "ice"}) {
    EXPECT_EQ(refusal(object(std::string("type: sphere, radius_m: 1, material: ") + name)), "accepted") << name;
  }
}

TEST(LoadScene, InstancesShareOneMesh) {
  const auto scene =
      parsed(object("name: pile, type: cylinder, radius_m: 1, length_m: 1, material: wood, "
                    "instances: [{xyz_m: [1, 0, 0]}, {xyz_m: [2, 0, 0], rpy_deg: [0, 0, 90]}]"));
  ASSERT_EQ(scene->objects.size(), 2u);
  EXPECT_EQ(scene->objects[0].mesh, scene->objects[1].mesh);
  EXPECT_EQ(scene->objects[1].name, "pile[1]");
  EXPECT_NEAR(rpy_from_quat(scene->objects[1].in_world.orientation).yaw_rad, pi / 2, 1e-12);
}

TEST(ShapeCache, EqualShapesShareAMeshUntilThereAreTooMany) {
  ShapeCache cache;
  int made = 0;
  const auto shape = [&](const std::string& key, std::size_t triangles) {
    return cache.shape(key, [&] {
      ++made;
      auto mesh = std::make_shared<Mesh>();
      mesh->triangles.resize(triangles);
      return Shape{std::move(mesh), {}};
    });
  };
  const auto bed = shape("bed", 2 * ShapeCache::most_triangles).mesh;
  const std::weak_ptr<const Mesh> first = shape("stone 0", 1000).mesh;
  for (int i = 1; i < 200; ++i) {
    shape("stone " + std::to_string(i), 1000);
    EXPECT_EQ(shape("bed", 0).mesh, bed) << "in use all the time";
  }
  EXPECT_EQ(made, 201);
  EXPECT_TRUE(first.expired());
  EXPECT_FALSE(cache.shape("none", [] { return Shape{}; }).mesh);
  EXPECT_EQ(shape("none", 3).mesh->triangles.size(), 3u) << "one without a mesh is tried again";
}

TEST(LoadScene, MovingBodiesKeepTheirOrderAndCarryOthers) {
  const auto scene = parsed(R"(
objects:
  - {name: ground, type: plane, size_m: [9, 9], material: sand}
  - {name: diver, type: capsule, radius_m: 0.2, length_m: 1, material: rubber, moving: true, pose: {xyz_m: [5, 0, -2], rpy_deg: [0, 0, 90]}}
  - {name: echo, type: point, target_strength_db: -10, moving: true, pose: {xyz_m: [7, 7, 7]}}
  - {name: tank, type: cylinder, radius_m: 0.1, length_m: 0.6, material: steel, attached_to: diver, pose: {xyz_m: [1, 0, 0]}}
  - {name: lamp, type: point, target_strength_db: -30, attached_to: diver, pose: {xyz_m: [0, 0, 0.5]}}
)");
  EXPECT_EQ(scene->body_names, (std::vector<std::string>{"diver", "echo"}));
  ASSERT_EQ(scene->bodies_in_world.size(), 2u);
  EXPECT_EQ(scene->bodies_in_world[1].position_m.x, 7);
  EXPECT_EQ(scene->objects[0].body, -1);
  EXPECT_EQ(scene->objects[1].body, 0);
  EXPECT_EQ(scene->objects[2].body, 0);
  EXPECT_NEAR(length(scene->objects[1].in_world.position_m - Vec3d{5, 0, -2}), 0, 1e-12);
  EXPECT_NEAR(length(scene->objects[2].in_world.position_m - Vec3d{5, 1, -2}), 0, 1e-12);  // rotated with the diver
  EXPECT_EQ(scene->point_targets[0].body, 1);
  EXPECT_EQ(length(scene->point_targets[0].position_m), 0);
  EXPECT_EQ(scene->point_targets[1].body, 0);
  EXPECT_EQ(scene->point_targets[1].position_m.z, 0.5);
  EXPECT_NEAR(length(scene->in_world(scene->point_targets[1], {}) - Vec3d{5, 0, -1.5}), 0, 1e-12) << "poses of the file";
  const std::vector<Pose> moved{{{1, 2, 3}, {}}};  // only the first body has a pose
  EXPECT_NEAR(length(scene->in_world(scene->point_targets[1], moved) - Vec3d{1, 2, 3.5}), 0, 1e-12);
  EXPECT_NEAR(length(scene->in_world(scene->point_targets[0], moved) - Vec3d{7, 7, 7}), 0, 1e-12);
}

TEST(LoadScene, MeshFilesHaveMaterialsByNameAndShareMeshes) {
  TemporaryFiles files;
  files.write("m.mtl", "newmtl hull\nnewmtl deck\n");
  files.write("m.obj",
              "mtllib m.mtl\nv 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 3\nusemtl hull\nf 1 3 2\nf 1 2 4\nusemtl deck\nf 1 4 3\nf 2 3 4\n");
  const auto scene = parsed(R"(
objects:
  - {type: mesh, file: m.obj, materials: {hull: steel, deck: wood}, pose: {xyz_m: [100, 0, 0]}}
  - {type: mesh, file: m.obj, materials: {hull: steel}, material: wood}
  - {type: mesh, file: m.obj, material: ice}
)",
                            files.folder());
  EXPECT_EQ(scene->objects[0].mesh, scene->objects[1].mesh);
  EXPECT_NE(scene->objects[0].mesh, scene->objects[2].mesh);
  std::map<std::string, int> count;
  for (const std::uint16_t m : scene->objects[0].mesh->material) ++count[scene->materials[m].name];
  EXPECT_EQ(count["steel"], 2);
  EXPECT_EQ(count["wood"], 2);
  EXPECT_NEAR(scene->objects[0].in_world.position_m.x, 101, 1e-9);  // the file's origin stays at the pose
  EXPECT_THAT(refusal(object("type: mesh, file: m.obj"), files.folder()),
              StartsWith("s.yaml:2:5: objects[0].material: needed, because the mesh's material \""));
  EXPECT_THAT(refusal(object("type: mesh, file: m.obj, material: ice, materials: {hul: steel}"), files.folder()),
              HasSubstr("objects[0].materials.hul: the mesh has no material of this name; did you mean \"hull\"?"));
  EXPECT_THAT(refusal(object("type: mesh, file: none.obj, material: ice"), files.folder()),
              StartsWith("s.yaml:2:24: objects[0].file: no mesh file at "));
}

TEST(LoadScene, PipesAndDevicesAreRefusedWithoutWaiting) {
  TemporaryFiles files;
  for (const char* pipe : {"p.png", "p.asc", "p.obj", "p.ply", "p.yaml", "p.mtl"})
    ASSERT_EQ(::mkfifo(files.path(pipe).c_str(), 0600), 0);
  const auto is_said = [&](const std::string& text) {
    EXPECT_THAT(refusal(text, files.folder()), HasSubstr(": is a FIFO, not a regular file")) << text;
  };
  is_said(object("type: heightmap, file: p.png, size_m: [1, 1], height_m: [0, 1], material: sand"));
  is_said(object("type: heightmap, file: p.asc, material: sand"));
  is_said(object("type: mesh, file: p.obj, material: ice"));
  is_said(object("type: mesh, file: p.ply, material: ice"));
  is_said("material_library: p.yaml\n" + object("type: sphere, radius_m: 1, material: steel"));
  const auto scene = load_scene(files.path("p.yaml"));
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().text, HasSubstr("p.yaml: is a FIFO"));
  files.write("m.obj", "mtllib p.mtl\nv 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 3 2\n");
  EXPECT_EQ(parsed(object("type: mesh, file: m.obj, material: ice"), files.folder())->objects.size(), 1u)
      << "materials are named in the scene: those of the file that cannot be read cost nothing";
}

TEST(LoadScene, HeightmapsStandInTheirOwnCoordinates) {
  TemporaryFiles files;
  files.write("g.asc", "ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 2000\ncellsize 2\n1 2 3\n4 5 6\n");
  const auto scene = parsed(R"(
objects:
  - {type: heightmap, file: g.asc, material: sand, pose: {xyz_m: [0, 0, -20]}}
  - {type: heightmap, file: g.asc, material: sand, centred: true, pose: {xyz_m: [0, 0, -20]}}
)",
                            files.folder());
  EXPECT_NEAR(scene->objects[0].in_world.position_m.x, 1003, 1e-9);
  EXPECT_NEAR(scene->objects[0].in_world.position_m.z, -16.5, 1e-9);
  EXPECT_NEAR(scene->objects[1].in_world.position_m.x, 0, 1e-9);
  for (const char* other : {"g.txt", "g.grd"}) {  // downloaded files have many extensions
    const std::string grid = "type: heightmap, material: sand, file: " + std::string(other);
    EXPECT_THAT(refusal(object(grid), files.folder()),
                ::testing::AnyOf(HasSubstr("unknown height format"), HasSubstr("cannot be opened")));
    files.write(other, "Ncols 2\nnrows 2\nxllcorner 1\nyllcorner 1\ncellsize 1\n1 2\n3 4\n");
    EXPECT_NEAR(parsed(object(grid), files.folder())->objects[0].in_world.position_m.x, 2, 1e-9);
  }
  files.write("g.dat", "cellsize=1\nnrows=2\nncols=2\nxllcorner=1\nyllcorner=1\n1 2\n3 4\n");
  files.write("points.asc", "1.5 1.5 3\n2.5 1.5 4\n1.5 2.5 1\n2.5 2.5 2\n");
  for (const char* other : {"g.dat", "points.asc"})
    EXPECT_NEAR(parsed(object("type: heightmap, material: sand, file: " + std::string(other)), files.folder())
                    ->objects[0]
                    .in_world.position_m.x,
                2, 1e-9)
        << other;
  files.write("g.pgm", "P2\n");
  files.write("lfs.png", "version https://git-lfs.github.com/spec/v1\n");
  EXPECT_THAT(refusal(object("type: heightmap, file: lfs.png, material: sand, size_m: [1, 1], height_m: [0, 1]"), files.folder()),
              HasSubstr("git lfs pull"));
  EXPECT_THAT(refusal(object("type: heightmap, file: g.pgm, material: sand"), files.folder()),
              HasSubstr("gdal_translate -of PNG g.pgm g.png"));
  files.write("g.ply", "ply\n");
  EXPECT_THAT(refusal(object("type: heightmap, file: g.ply, material: sand"), files.folder()), HasSubstr("write type: mesh"));
  files.write("g.bin", std::string("II*\0", 4));
  EXPECT_THAT(refusal(object("type: heightmap, file: g.bin, material: sand"), files.folder()),
              ::testing::Not(HasSubstr("unknown height format")));
  // The content of a file counts, not its extension.
  files.write("t.png", std::string("II*\0", 4));
  EXPECT_THAT(refusal(object("type: heightmap, file: t.png, material: sand"), files.folder()), HasSubstr("TIFF"));
  files.write("p.tif", "\x89PNG\r\n\x1a\n");
  EXPECT_THAT(refusal(object("type: heightmap, file: p.tif, material: sand"), files.folder()), HasSubstr("size_m"));
  files.write("j.png", "\xff\xd8\xff\xe0");
  EXPECT_THAT(refusal(object("type: heightmap, file: j.png, material: sand, size_m: [1, 1], height_m: [0, 1]"), files.folder()),
              HasSubstr("is a JPEG picture"));
}

TEST(LoadScene, LostTrianglesOfAMeshAreANote) {
  TemporaryFiles files;
  files.write("m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\nf 1 3 4\n");
  EXPECT_THAT(parsed(object("type: mesh, file: m.obj, material: ice"), files.folder())->notes,
              ::testing::ElementsAre(HasSubstr("m.obj: 1 of the triangles that it lists cannot be read and are missing here")));
}

TEST(LoadScene, HeightmapsInDegreesStandAboutAnOrigin) {
  TemporaryFiles files;
  files.write("g.asc", "ncols 3\nnrows 3\nxllcenter 5\nyllcenter 60\ncellsize 0.01\n-1 -2 -3\n-4 -5 -6\n-7 -8 -9999\n");
  const std::string bed = "type: heightmap, file: g.asc, material: sand, ";
  const auto scene = parsed(object(bed + "geographic: true, origin: {lat: 60, lon: 5}"), files.folder());
  EXPECT_NEAR(scene->objects[0].in_world.position_m.x, 557.9, 0.5);  // 0.01 degrees, slightly less in the north
  EXPECT_NEAR(scene->objects[0].in_world.position_m.y, 1114.2, 0.5);
  EXPECT_THAT(scene->notes, ::testing::ElementsAre("g.asc: 1 of its 9 heights (11 %) are missing: holes in the ground"));
  EXPECT_THAT(refusal(object(bed + "origin: {lat: 60, lon: 5}, centred: true"), files.folder()),
              HasSubstr("origin: give origin or centred, not both"));
  EXPECT_THAT(refusal(object(bed + "origin: {lat: 91, lon: 5}"), files.folder()), HasSubstr("origin.lat"));
  EXPECT_THAT(refusal(object(bed + "geographic: true, origin: {lat: 40, lon: 5}"), files.folder()), HasSubstr("at most 5"));
}

TEST(LoadScene, TheMiddleOfACentredGridInDegreesIsAtThePose) {
  TemporaryFiles files;  // the parallel of 60 degrees is 1690 m longer than that of 61
  files.write("g.asc", "ncols 3\nnrows 3\nxllcenter 5\nyllcenter 60\ncellsize 0.5\n-1 -1 -1\n-1 -1 -1\n-1 -1 -1\n");
  const std::string bed = "type: heightmap, file: g.asc, material: sand, geographic: true";
  const auto of_its_own = parsed(object(bed), files.folder()), centred = parsed(object(bed + ", centred: true"), files.folder());
  const Vec3d own_m = of_its_own->objects[0].in_world.position_m, middle_m = centred->objects[0].in_world.position_m;
  EXPECT_GT(std::hypot(own_m.x, own_m.y), 100);  // the mesh is relative to the middle between its first and its last vertex
  EXPECT_NEAR(middle_m.x, own_m.x, 1e-6);
  EXPECT_NEAR(middle_m.y, own_m.y, 1e-6);
}

TEST(LoadScene, AMaterialLibraryCanBeGiven) {
  TemporaryFiles files;
  files.write("lib.yaml", "kelp: {lambert_db: -40}\n");
  const std::string text = "material_library: lib.yaml\n" + object("type: sphere, radius_m: 1, material: kelp");
  EXPECT_EQ(parsed(text, files.folder())->materials[0].name, "kelp");
  files.write("lib.yaml", "kelp: {lambert: -40}\n");
  EXPECT_THAT(refusal(text, files.folder()), HasSubstr("lib.yaml:1:8: kelp.lambert: unknown key; did you mean \"lambert_db\"?"));
}

TEST(LoadScene, ErrorsNameTheirPlaceAndTheNearestName) {
  EXPECT_EQ(refusal("name: x\n"), "s.yaml:1:1: objects: required key is missing");
  EXPECT_EQ(refusal("objcts: []\n"), "s.yaml:1:1: objcts: unknown key; did you mean \"objects\"?");
  EXPECT_EQ(refusal(object("type: sphre, material: sand")),
            "s.yaml:2:12: objects[0].type: unknown value \"sphre\"; did you mean \"sphere\"?");
  EXPECT_EQ(refusal(object("type: sphere, material: snad, radius_m: 1")),
            "s.yaml:2:30: objects[0].material: unknown material \"snad\"; did you mean \"sand\"?");
  EXPECT_EQ(refusal(object("type: sphere, material: sand, radius: 1")),
            "s.yaml:2:36: objects[0].radius: unknown key; did you mean \"radius_m\"?");
  EXPECT_EQ(refusal(object("type: sphere, material: sand, radius_m: -1")),
            "s.yaml:2:46: objects[0].radius_m: must be between 0.0001 and 100000, found -1");
  EXPECT_EQ(refusal(object("type: sphere, radius_m: 1")), "s.yaml:2:5: objects[0].material: required key is missing");
  EXPECT_EQ(refusal(object("typ: sphere, radius_m: 1")), "s.yaml:2:6: objects[0].typ: unknown key; did you mean \"type\"?");
  EXPECT_THAT(refusal(object("type: box, material: sand, size_m: [2, 1000, 1], patch_m: 2.49")),
              HasSubstr("patch_m: must be at least 2.5: an edge has at most 400 patches"));
  EXPECT_THAT(refusal(object("type: plane, material: sand, size_m: [1000, 2], patch_m: 2.49")), HasSubstr("patch_m: must be"));
  EXPECT_THAT(refusal(object("type: box, material: sand, size_m: [1, 1]")), HasSubstr("size_m: must be a list of 3 numbers"));
  EXPECT_THAT(refusal(object("type: torus, material: sand, radius_m: 1, tube_radius_m: 1")),
              HasSubstr("must be smaller than radius_m"));
  EXPECT_THAT(refusal(object("type: point, target_strength_db: 0, moving: true, attached_to: x")), HasSubstr("not both"));
  EXPECT_THAT(refusal(object("type: point, target_strength_db: 0, attached_to: x")),
              HasSubstr("no moving object \"x\" above this one"));
  EXPECT_THAT(refusal(object("type: sphere, radius_m: 1, material: sand, pose: {}, instances: [{}]")),
              HasSubstr("give pose or instances"));
  EXPECT_THAT(refusal(object("type: sphere, radius_m: 1, material: sand, moving: true, instances: [{}]")),
              HasSubstr("has one pose"));
  EXPECT_THAT(
      refusal("objects:\n  - {name: a, type: point, target_strength_db: 0}\n  - {name: a, type: point, target_strength_db: 0}\n"),
      HasSubstr("s.yaml:3:12: objects[1].name: name is used twice"));
  EXPECT_THAT(refusal("materials: {a: {like: snd}}\nobjects: []"),
              HasSubstr("materials.a.like: unknown material \"snd\"; did you mean \"sand\"?"));
  EXPECT_THAT(refusal("materials: {a: {lambert_db: -4}}\nobjects: []"), HasSubstr("must be between -80 and -4.97, found -4"));
  EXPECT_THAT(refusal(object("type: seabed, material: sand, size_m: [90000, 90000], spacing_m: 0.01, fine_size_m: [9000, 9000]")),
              HasSubstr("makes more than 20 million triangles"));
  const auto error = parse_scene("objects: 1", "s.yaml", ".");
  EXPECT_EQ(error.error().kind, ErrorKind::bad_data);
  EXPECT_EQ(load_scene("no/scene.yaml").error().kind, ErrorKind::missing_file);
}

TEST(LoadScene, TheTriangleCapCountsInstances) {
  std::string text = "objects:\n  - {type: torus, material: sand, radius_m: 90, tube_radius_m: 80, segments: 2048, instances: [";
  for (int i = 0; i < 20; ++i) text += i ? ", {}" : "{}";
  EXPECT_THAT(refusal(text + "]}\n"), HasSubstr("the scene has more than 20 million triangles here"));
}

TEST(LoadScene, TheExampleOfTheDocumentationLoads) {
  const std::string page = TemporaryFiles::read(std::filesystem::path(SONARD_SOURCE_DIR) / "docs" / "scenes.md");
  const std::size_t from = page.find("```yaml\n") + 8, to = page.find("```", from);
  ASSERT_LT(to, page.size());
  TemporaryFiles files;
  files.write("ours.yaml", "weed: {lambert_db: -35}\n");
  const auto scene = parsed(page.substr(from, to - from), files.folder());
  EXPECT_EQ(scene->body_names, std::vector<std::string>{"diver"});
  EXPECT_EQ(scene->objects.size(), 6u);
}

TEST(LoadScene, OtherSonarsHavePlaceLevelAndRate) {
  const auto scene = parsed(
      "objects: []\nother_sonars:\n  - {name: rov, xyz_m: [9, 2, -3], level_db: 120, rate_hz: 12, pulse_ms: 0.4}\n"
      "  - {xyz_m: [0, 0, 0], level_db: 60}\n");
  ASSERT_EQ(scene->other_sonars.size(), 2u);
  const OtherSonar& rov = scene->other_sonars[0];
  EXPECT_EQ(rov.name, "rov");
  EXPECT_EQ(rov.position_m.x, 9);
  EXPECT_NEAR(rov.level_upa, 1e6f, 1);
  EXPECT_EQ(rov.rate_hz, 12);
  EXPECT_NEAR(rov.pulse_s, 4e-4f, 1e-9);
  EXPECT_EQ(scene->other_sonars[1].name, "other sonar 2");
  EXPECT_THAT(refusal("objects: []\nother_sonars: [{xyz_m: [0, 0, 0]}]"), HasSubstr("level_db"));
  EXPECT_THAT(refusal("objects: []\nother_sonars: [{xyz_m: [0, 0, 0], level_db: 60, rate: 3}]"), HasSubstr("rate"));
}

TEST(LoadScene, AnEmptyListIsAnEmptyScene) { EXPECT_EQ(parsed("objects: []")->objects.size(), 0u); }

TEST(LoadScene, MutationsGiveASceneOrAnError) {
  const std::string good = R"(name: m
materials: {a: {like: sand, lambert_db: -20}}
objects:
  - {name: b, type: box, material: a, size_m: [1, 2, 3], patch_m: 1, pose: {xyz_m: [1, 2, 3], rpy_deg: [1, 2, 3]}}
  - {type: sphere, radius_m: 0.3, material: steel, moving: true}
  - {type: cone, radius_m: 0.3, length_m: 1, segments: 12, material: steel, instances: [{xyz_m: [1, 1, 1]}]}
  - {type: seabed, material: mud, size_m: [4, 4], spacing_m: 1, octaves: 2, ripples: {wavelength_m: 2, height_m: 0.1}}
  - {type: point, target_strength_db: -3}
sea_surface: {size_m: [9, 9]}
)";
  ASSERT_EQ(refusal(good), "accepted");
  constexpr std::string_view alphabet = "0123456789-.eE[]{}:, \nabm_~'\"";
  const auto check = [](const std::string& text) {
    const auto scene = parse_scene(text, "s.yaml", ".");
    if (!scene) {
      EXPECT_THAT(scene.error().text, StartsWith("s.yaml:"));
      return;
    }
    for (const Object& o : (*scene)->objects) tests::expect_sound(*o.mesh);
  };
  for (std::size_t n = 0; n < good.size(); n += 5) check(good.substr(0, n));
  for (std::uint32_t i = 0; i < (test::is_sanitized ? 200 : 1200); ++i) {  // scene_fuzz makes more mutations
    const Random4 r = philox(i, 0, 0, 0, 5, 6);
    std::string bad = good;
    bad[r.v[0] % bad.size()] = alphabet[r.v[1] % alphabet.size()];
    if (r.v[2] & 1) bad.erase(r.v[2] % bad.size(), 1);
    check(bad);
  }
}

TEST(LoadScene, ShapesKnowTheTrueSurfaceBehindTheirMesh) {
  const auto scene = parsed(R"(
objects:
  - {name: ball, type: sphere, material: steel, radius_m: 0.3}
  - {name: rod, type: cylinder, material: steel, radius_m: 0.1, length_m: 2, instances: [{}, {xyz_m: [1, 0, 0]}]}
  - {name: tank, type: cylinder, material: steel, radius_m: 1, length_m: 1.2, caps: bottom}
  - {name: block, type: box, material: steel, size_m: [1, 2, 3]}
  - {name: plate, type: plane, material: steel, size_m: [0.2, 0.4]}
  - {name: buoy, type: capsule, material: steel, radius_m: 0.1, length_m: 1}
)");
  using Kind = Primitive::Kind;
  const auto of = [&](std::size_t i) { return scene->objects.at(i).primitive; };
  EXPECT_EQ(of(0).kind, Kind::sphere);
  EXPECT_EQ(of(0).radius_m, 0.3);
  for (const std::size_t rod : {1u, 2u}) {
    EXPECT_EQ(of(rod).kind, Kind::cylinder);
    EXPECT_EQ(of(rod).radius_m, 0.1);
    EXPECT_EQ(of(rod).size_m.z, 2);
    EXPECT_FALSE(of(rod).inside);
  }
  EXPECT_TRUE(of(3).inside);
  EXPECT_EQ(of(4).kind, Kind::box);
  EXPECT_EQ(of(4).size_m.y, 2);
  EXPECT_EQ(of(5).kind, Kind::plane);
  EXPECT_EQ(of(5).size_m.x, 0.2);
  EXPECT_EQ(of(5).size_m.y, 0.4);
  EXPECT_EQ(of(6).kind, Kind::none);
}

}  // namespace
}  // namespace sonar
