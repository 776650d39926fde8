#include "clients/scene_tools/import_scene.hpp"

#include <gmock/gmock.h>
#include <png.h>

#include <cstdlib>
#include <optional>

#include "clients/scene_tools/resource_paths.hpp"
#include "core/scene/files/load_scene.hpp"
#include "tests/clients/scene_tools/reading.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::scene_tools {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* triangle =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

struct ImportScene : ::testing::Test {
  sonar::tests::TemporaryFiles files;
  ImportOptions options;

  ImportScene() {
    options.out = files.path("out.yaml");
    options.overwrite = true;
  }
  void write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories(files.path(name).parent_path());
    files.write(name, text);
  }
  Result<Imported> run(const std::string& world, const char* name = "w.sdf") {
    write(name, world);
    options.file = files.path(name);
    return import_scene(options);
  }
  std::string error(const std::string& world) {
    const auto done = run(world);
    return done ? "no error" : done.error().text;
  }
  std::string text() { return sonar::tests::TemporaryFiles::read(options.out); }
  std::shared_ptr<const Scene> scene() {
    auto loaded = load_scene(options.out);
    EXPECT_TRUE(loaded) << loaded.error().text << "\n" << text();
    return loaded ? *loaded : std::make_shared<Scene>();
  }
  /// Returns a link with a mesh in it.
  static std::string mesh(const std::string& uri, const std::string& scale = "1 1 1") {
    return std::string("<link name='l'><visual name='v'><geometry><mesh><uri>") + uri + "</uri><scale>" + scale +
           "</scale></mesh></geometry></visual></link>";
  }
};

TEST_F(ImportScene, ModelsAreFoundBesideTheFileInGivenFoldersAndInTheEnvironment) {
  const auto folder_of = [&](const std::string& name) {
    write(name + "/model.sdf",
          std::string("<sdf><model name='") + name.substr(name.rfind('/') + 1) + "'>" + link("l") + "</model></sdf>");
  };
  folder_of("models/near");
  folder_of("elsewhere/given");
  folder_of("third/gz");
  write("elsewhere/versions/model.config",
        "<model><sdf version='1.9'>old.sdf</sdf><sdf version='1.10'>new.sdf</sdf><sdf version='2.0'>gone.sdf</sdf></model>");
  write("elsewhere/versions/old.sdf", "<sdf><model name='old'/></sdf>");
  write("elsewhere/versions/new.sdf", std::string("<sdf><model name='new'>") + link("l") + "</model></sdf>");
  options.model_folders = {files.path("elsewhere")};
  setenv("GZ_SIM_RESOURCE_PATH", (std::string(":/no/such/folder:") + files.path("third").string()).c_str(), 1);
  const auto done =
      run(sdf("<include><uri>model://near</uri></include><include><uri>model://given</uri></include>"
              "<include><uri>model://gz</uri></include><include><uri>model://versions</uri></include>"
              "<include><uri>https://fuel.example/models/near</uri><name>copy</name></include>"));
  unsetenv("GZ_SIM_RESOURCE_PATH");
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->shapes, 5u);
  const auto made = scene();
  ASSERT_EQ(made->objects.size(), 5u);
  EXPECT_EQ(made->objects[3].name, "new");
  EXPECT_THAT(text(), HasSubstr("# near (near/model.sdf:1)"));
}

TEST_F(ImportScene, ModelsIncludeTheirNeighbours) {
  const auto holding = [](const char* name, const std::string& content) {
    return std::string("<sdf version='1.9'><model name='") + name + "'>" + content + "</model></sdf>";
  };
  const auto mesh = [](const std::string& uri) {
    return "<link name='l'><visual name='v'><geometry><mesh><uri>" + uri + "</uri></mesh></geometry></visual></link>";
  };
  write("models/tile/model.sdf", holding("tile", mesh("model://tile/meshes/a.stl")));
  write("models/tile/meshes/a.stl", triangle);
  write("models/field/meshes/a.stl", "not this one");
  const std::string field =
      holding("field", "<include><uri>model://tile</uri><name>near</name></include>" + mesh("model://tile/meshes/a.stl"));
  const auto done = run(field, "models/field/model.sdf");
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->shapes, 2u);
  EXPECT_EQ(scene()->objects.size(), 2u);
  // This file belongs to the model itself, whose folder has another name.
  write("models/clone/meshes/own.stl", triangle);
  const auto renamed = run(holding("crate", mesh("model://crate/meshes/own.stl")), "models/clone/model.sdf");
  EXPECT_TRUE(renamed) << renamed.error().text;
  // This model has the name of the Fuel model that it includes.
  const auto same = run(holding("block", "<include><uri>https://fuel.gazebosim.org/1.0/me/models/block</uri></include>"),
                        "models/block/model.sdf");
  ASSERT_FALSE(same);
  EXPECT_THAT(same.error().text, HasSubstr("gz fuel download --url 'https://fuel.gazebosim.org/1.0/me/models/block'"));
}

struct Environment {
  Environment(const char* variable, const std::string& value) : variable_(variable) {
    if (const char* old = std::getenv(variable)) before_ = old;
    setenv(variable, value.c_str(), 1);
  }
  ~Environment() { before_ ? setenv(variable_, before_->c_str(), 1) : unsetenv(variable_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* variable_;
  std::optional<std::string> before_;
};

TEST_F(ImportScene, FilesOfRosPackagesAreFound) {
  write("src/rov_description/package.xml", "<package><name>rov</name></package>");  // its folder has another name
  write("src/rov_description/meshes/a.stl", triangle);
  write("installed/share/hulls/meshes/a.stl", triangle);
  const auto urdf = [&](const std::string& file) {
    return run(
        "<robot name='r'><link name='l'><visual><geometry><mesh filename='" + file + "'/></geometry></visual></link></robot>",
        "src/rov_description/urdf/r.urdf");
  };
  const auto own = urdf("package://rov/meshes/a.stl");
  EXPECT_TRUE(own) << own.error().text;
  EXPECT_FALSE(urdf("package://other/meshes/a.stl"));
  write("repository/cage_description/package.xml", "<package><name>cage</name></package>");
  write("repository/cage_description/meshes/a.stl", triangle);
  options.model_folders = {files.path("repository")};
  const auto given = urdf("package://cage/meshes/a.stl");
  EXPECT_TRUE(given) << given.error().text;
  EXPECT_FALSE(urdf("package://hulls/meshes/a.stl"));
  const Environment prefix("AMENT_PREFIX_PATH", files.path("none").string() + ":" + files.path("installed").string());
  const auto installed = urdf("package://hulls/meshes/a.stl");
  EXPECT_TRUE(installed) << installed.error().text;
}

/// Both generations of Gazebo store HOST/OWNER/models/NAME/VERSION in lower case.
TEST_F(ImportScene, FuelModelsAreFoundInTheCachesOfGazebo) {
  const Environment home("HOME", files.path("home").string()), none("GZ_FUEL_CACHE_PATH", ""), nor("IGN_FUEL_CACHE_PATH", "");
  const auto box = [](const char* name, const char* size) {
    return std::string("<sdf version='1.9'><model name='") + name + "'><link name='l'><visual name='v'><geometry><box><size>" +
           size + "</size></box></geometry></visual></link></model></sdf>";
  };
  const std::string gz = "home/.gz/fuel/fuel.gazebosim.org/hmoyen/models/";
  write(gz + "sand bed/2/model.sdf", box("old", "1 1 1"));
  write(gz + "sand bed/10/model.config", "<model><sdf version='1.9'>bed.sdf</sdf></model>");
  write(gz + "sand bed/10/bed.sdf", box("bed", "20 20 1"));
  write("home/.ignition/fuel/fuel.ignitionrobotics.org/cole/models/coral01/1/model.sdf",
        "<sdf version='1.9'><model name='coral'>" +
            mesh("https://fuel.ignitionrobotics.org/1.0/Cole/models/Coral01/1/files/meshes/c.STL") + "</model></sdf>");
  write("home/.ignition/fuel/fuel.ignitionrobotics.org/cole/models/coral01/1/meshes/c.stl", triangle);
  write(gz + "vase/3/model.sdf", "<sdf version='1.9'><model name='vase'>" + mesh("model://Vase/meshes/v.stl") + "</model></sdf>");
  write(gz + "vase/3/meshes/v.stl", triangle);
  const std::string fuel = "<include><uri>https://fuel.gazebosim.org/1.0/";
  const auto done = run(sdf(fuel + "OpenRobotics/models/Sun</uri></include>" + fuel +
                            "hmoyen/models/Sand Bed</uri><pose>0 0 -5 0 0 0</pose></include>" + fuel +
                            "hmoyen/models/Sand%20Bed/2</uri></include>" + fuel + "Cole/models/Coral01/tip</uri></include>" +
                            fuel + "hmoyen/models/Vase</uri></include>" +
                            "<include><uri>https://app.gazebosim.org/hmoyen/fuel/models/Sand Bed</uri></include>" +
                            "<include><uri>https://app.ignitionrobotics.org/hmoyen/fuel/models/Sand Bed/</uri></include>"));
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_THAT(done->left_out, ElementsAre("1 light: without an echo"));
  const auto described = describe_scene(options.out);
  ASSERT_TRUE(described) << described.error().text;
  ASSERT_EQ(described->objects.size(), 6u) << text();
  EXPECT_EQ(described->objects[0].name, "bed");
  EXPECT_NEAR(described->objects[0].in_world.size_m().x, 20, 1e-5);
  EXPECT_NEAR(described->objects[0].in_world.centre_m().z, -5, 1e-5);
  EXPECT_NEAR(described->objects[1].in_world.size_m().x, 1, 1e-5);
  // The folder of models is given; the cache is not used.
  const Environment elsewhere("HOME", "/nonexistent");
  options.model_folders = {files.path("home/.gz/fuel/fuel.gazebosim.org/hmoyen/models")};
  const auto given = run(sdf(fuel + "hmoyen/models/Sand Bed</uri></include>"));
  ASSERT_TRUE(given) << given.error().text;
  EXPECT_THAT(text(), HasSubstr("size_m: [20, 20, 1]"));
  EXPECT_TRUE(run(sdf(fuel + "hmoyen/models/Sand Bed/2</uri></include>")));
  EXPECT_THAT(text(), HasSubstr("size_m: [1, 1, 1]"));
  // A version other than the named one is not used in its place.
  const std::string third = sdf(fuel + "hmoyen/models/Sand Bed/3</uri></include>");
  EXPECT_THAT(error(third), HasSubstr("gz fuel download --url 'https://fuel.gazebosim.org/1.0/hmoyen/models/Sand Bed/3'"));
  const Environment again("HOME", files.path("home").string());
  options.model_folders.clear();
  EXPECT_THAT(error(third), HasSubstr("hmoyen/models/Sand Bed/3'"));
}

TEST_F(ImportScene, FuelModelsAreFoundInFoldersWithAnotherSpelling) {
  const Environment home("HOME", "/nonexistent"), none("GZ_FUEL_CACHE_PATH", ""), nor("IGN_FUEL_CACHE_PATH", "");
  const std::string fuel = "https://fuel.gazebosim.org/1.0/hmoyen/models/";
  write("dave/models/sunken_vase/model.sdf",
        "<sdf version='1.9'><model name='vase'>" + mesh(fuel + "Sunken%20Vase/3/files/meshes/Pot 01.stl") + "</model></sdf>");
  write("dave/models/sunken_vase/meshes/pot_01.stl", triangle);
  options.model_folders = {files.path("dave/models")};
  const auto done = run(sdf("<include><uri>" + fuel + "Sunken Vase</uri></include><include><uri>" + fuel +
                            "sunken%20vase/2</uri><name>b</name></include><include><uri>model://Sunken Vase</uri><name>c</name>"
                            "</include>"));
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->shapes, 3u);
  EXPECT_THAT(done->left_out, ElementsAre());
  options.model_folders.clear();
  EXPECT_THAT(error(sdf("<include><uri>" + fuel + "Sunken Vase</uri></include>")), HasSubstr("were not found"));
  // The folder models beside the world is searched too.
  write("models/sunken_vase/model.sdf", "<sdf version='1.9'><model name='vase'>" + link("l") + "</model></sdf>");
  EXPECT_EQ(error(sdf("<include><uri>" + fuel + "Sunken Vase</uri></include>")), "no error");
}

TEST_F(ImportScene, AnEmptySceneIsAnErrorThatSaysWhatIsMissing) {
  const Environment home("HOME", files.path("home").string());
  options.read.skip_missing = true;
  const std::string world =
      sdf("<light name='l'/><include><uri>https://fuel.gazebosim.org/1.0/hmoyen/models/Sand Heightmap</uri></include>");
  EXPECT_THAT(error(world),
              ::testing::AllOf(HasSubstr("w.sdf: nothing in it has a shape"), HasSubstr("; 1 light: without an echo"),
                               HasSubstr("gz fuel download --url 'https://fuel.gazebosim.org/1.0/hmoyen/models/Sand "
                                         "Heightmap'")));
  EXPECT_FALSE(std::filesystem::exists(options.out));
}

TEST_F(ImportScene, MeshPathsAreRelativeAndUnevenScalesAreConverted) {
  write("pkg/meshes/a.stl", triangle);
  write("pkg/urdf/r.urdf", "");
  options.out = files.path("pkg/scenes/out.yaml");
  std::filesystem::create_directories(files.path("pkg/scenes"));
  const auto done =
      run("<robot name='r'><link name='a'><visual><geometry><mesh filename='package://pkg/meshes/a.stl' scale='2 2 2'/>"
          "</geometry></visual><visual><geometry><mesh filename='../meshes/a.stl' scale='1 -3 1'/></geometry></visual>"
          "</link></robot>",
          "pkg/urdf/r.urdf");
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->converted_meshes, 1u);
  EXPECT_THAT(text(), HasSubstr("file: \"../meshes/a.stl\", material: concrete, scale: 2,"));
  EXPECT_THAT(text(), HasSubstr("file: out-meshes/a-1.obj"));
  const auto described = describe_scene(options.out);
  ASSERT_TRUE(described) << described.error().text;
  EXPECT_NEAR(described->objects[0].in_world.size_m().x, 4, 1e-5);
  EXPECT_NEAR(described->objects[1].in_world.low_m.y, -3, 1e-5);
  EXPECT_NEAR(described->objects[1].in_world.size_m().x, 2, 1e-5);
}

TEST_F(ImportScene, APartOfAFileIsWrittenBesideTheScene) {
  const std::string hull = "o Hull\nv 0 0 0\nv 4 0 0\nv 0 1 0\nf 1 2 3\n";
  write("boat.obj", hull + "o Mast.1\nv 1 0 0\nv 3 0 0\nv 1 0 6\nf 4 5 6\n");
  write("one.obj", hull);
  const auto part = [](const std::string& name, const std::string& shown, const std::string& centre = "") {
    return model(name, std::string("<link name='l'><visual name='v'><geometry><mesh><uri>") +
                           (name == "d" ? "one.obj" : "boat.obj") + "</uri><submesh><name>" + shown + "</name>" + centre +
                           "</submesh></mesh></geometry></visual></link>");
  };
  const auto done =
      run(sdf(part("a", "Mast.1") + part("b", "Mast.1", "<center>true</center>") + part("c", "Hull", "<center>0</center>") +
              part("d", "Other") + part("e", "Gone") + part("f", "Gone") + part("g", "") + part("h", "Hull")));
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->shapes, 5u);
  EXPECT_EQ(done->converted_meshes, 4u);
  EXPECT_THAT(done->left_out, ElementsAre(HasSubstr("its submesh has no name"),
                                          HasSubstr("mesh boat.obj: has no part \"Gone\"; its parts: Hull, Mast.1")));
  const auto described = describe_scene(options.out);
  ASSERT_TRUE(described) << described.error().text;
  const auto& objects = described->objects;
  EXPECT_NEAR(objects[0].in_world.low_m.x, 1, 1e-5);
  EXPECT_NEAR(objects[0].in_world.high_m.z, 6, 1e-5);
  EXPECT_NEAR(objects[1].in_world.low_m.x, -1, 1e-5);
  EXPECT_NEAR(objects[1].in_world.high_m.z, 3, 1e-5);
  EXPECT_NEAR(objects[2].in_world.size_m().x, 4, 1e-5);
  EXPECT_NEAR(objects[3].in_world.size_m().y, 1, 1e-5);
}

TEST_F(ImportScene, FilesThatASceneCannotReadAreLeftOut) {
  write("a.fbx", "?");
  write("bad.stl", "solid nothing\nendsolid nothing\n");
  write("h.tif", "?");
  write("no.png", "not a picture");
  const auto heightmap = [](const std::string& file) {
    return std::string("<visual name='h'><geometry><heightmap><uri>") + file +
           "</uri><size>10 10 2</size></heightmap></geometry></visual>";
  };
  const auto done = run(sdf(model("a", mesh("a.fbx")) + model("b", mesh("bad.stl")) +
                            model("c", std::string("<link name='l'>") + heightmap("h.tif") + heightmap("no.png") + "</link>") +
                            model("d", link("l"))));
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->shapes, 1u);
  EXPECT_THAT(done->left_out, ElementsAre(HasSubstr("a.fbx: a scene reads OBJ"), HasSubstr("bad.stl"), HasSubstr("h.tif"),
                                          HasSubstr("no.png: ")));
  EXPECT_THAT(text(), HasSubstr("#   w.sdf:3: mesh a.fbx: a scene reads OBJ, STL, PLY, glTF, GLB and DAE\n"));
  EXPECT_THAT(error(sdf(model("a", mesh("gone.stl")))), HasSubstr("w.sdf:3: mesh gone.stl: the file was not found"));
  EXPECT_THAT(error(sdf(model("a", mesh("gone.stl")) + model("b", mesh("lost.stl")) + model("c", mesh("gone.stl")))),
              ::testing::EndsWith("with --skip-missing; also missing: mesh lost.stl"));
  options.read.skip_missing = true;
  EXPECT_EQ(error(sdf(model("a", mesh("gone.stl")) + model("d", link("l")))), "no error");
}

TEST_F(ImportScene, TheUnitOfAColladaFileIsUsed) {
  write("cm.dae", R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0 0 0 200 0 0 0 100 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)");
  const auto size = [&](const std::string& file, const std::string& scale = "1 1 1") {
    const auto done = run(sdf(model("m", mesh(file, scale))));
    EXPECT_TRUE(done) << done.error().text;
    const auto described = describe_scene(options.out);
    EXPECT_TRUE(described) << described.error().text;
    return described && described->objects.size() == 1 ? described->objects[0].in_world.size_m() : Vec3d{};
  };
  const auto expect_flat = [&](Vec3d is, Vec3d wanted) {
    EXPECT_NEAR(length(is - wanted), 0, 1e-5) << is.x << ' ' << is.y << ' ' << is.z << '\n' << text();
  };
  expect_flat(size("cm.dae"), {2, 1, 0});
  // Gazebo and RViz do not turn meshes whose files say that another axis is up.
  std::string other = sonar::tests::TemporaryFiles::read(files.path("cm.dae"));
  other.replace(other.find("Z_UP"), 4, "Y_UP");
  write("y.dae", other);
  expect_flat(size("y.dae"), {2, 1, 0});
  expect_flat(size("y.dae", "1 3 1"), {2, 3, 0});
  write("y.gltf",
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)"
        R"({"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
        R"("min":[0,0,0],"max":[2,1,0]}],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":)"
        R"("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
  expect_flat(size("y.gltf"), {2, 1, 0});
}

TEST_F(ImportScene, TheBrightestPixelOfAHeightmapHasItsHeight) {
  const std::vector<std::byte> grey{std::byte{0}, std::byte{50}, std::byte{100}, std::byte{0}};
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = image.height = 2;
  image.format = PNG_FORMAT_GRAY;
  ASSERT_TRUE(png_image_write_to_file(&image, files.path("h.png").c_str(), 0, grey.data(), 0, nullptr));
  const auto done = run(sdf(model("m",
                                  "<link name='l'><visual name='v'><geometry><heightmap><uri>h.png</uri><size>10 10 4</size>"
                                  "</heightmap></geometry></visual></link>")));
  ASSERT_TRUE(done) << done.error().text;
  const auto described = describe_scene(options.out);
  ASSERT_TRUE(described && described->objects.size() == 1) << text();
  EXPECT_NEAR(described->objects[0].in_world.size_m().z, 4, 1e-4) << text();
}

TEST_F(ImportScene, MaterialsComeFromArgumentsNamesOrTheDefault) {
  const std::string world = sdf(model("sand_bed", link("l")) + model("m", link("l")) + model("ship", model("hull", link("l"))) +
                                model("p",
                                      "<link name='l'><visual name='v'><geometry><plane><size>5 5</size></plane></geometry>"
                                      "<material><script><name>Gazebo/WoodFloor</name></script></material></visual></link>"));
  const auto materials = [&] {
    const auto done = run(world);
    EXPECT_TRUE(done) << done.error().text;
    std::vector<std::string> names;
    const auto made = scene();
    for (const Object& o : made->objects) names.push_back(made->materials.at(o.mesh->material.at(0)).name);
    return names;
  };
  EXPECT_THAT(materials(), ElementsAre("sand", "concrete", "concrete", "wood"));
  options.materials = {"ship=steel"};
  EXPECT_THAT(materials(), ElementsAre("sand", "concrete", "steel", "wood"));
  options.materials = {"ice", "ship=steel"};
  EXPECT_THAT(materials(), ElementsAre("ice", "ice", "steel", "ice"));
  options.materials = {"stel"};
  EXPECT_THAT(error(world), HasSubstr("did you mean \"steel\"?"));
  options.materials = {"shop=steel"};
  EXPECT_THAT(error(world), HasSubstr("--material shop=steel: no model of that name"));
}

TEST_F(ImportScene, MaterialsAreFoundByWordsInNames) {
  const auto material_of = [&](const std::string& world) {
    const auto done = run(world);
    if (!done) return done.error().text;
    const auto made = scene();
    return made->materials.at(made->objects.at(0).mesh->material.at(0)).name;
  };
  for (const auto& [name, material] : {std::pair{"Silt_patch", "mud"},
                                       {"PebbleBeach", "gravel"},
                                       {"boulder_3", "rock"},
                                       {"rusty anchor", "steel"},
                                       {"brick_wall", "concrete"},
                                       {"Iceberg", "ice"},
                                       {"stainless_pipe", "steel"},
                                       {"seafloor_2", "sand"},
                                       {"terrain mud", "mud"},
                                       {"pier", "concrete"}})
    EXPECT_EQ(material_of(sdf(model(name, link("l")))), material) << name;
  // The name of a model in a library is more descriptive than the names inside it.
  write("lib/Sand Heightmap/model.sdf", "<sdf version='1.9'><model name='m'>" + mesh("hill.stl") + "</model></sdf>");
  write("lib/Sand Heightmap/hill.stl", triangle);
  options.model_folders = {files.path("lib")};
  const std::string include = "<include><name>world</name><uri>https://fuel.gazebosim.org/1.0/hmoyen/models/";
  EXPECT_EQ(material_of(sdf(include + "Sand%20Heightmap</uri></include>")), "sand");
  // The name of a mesh file is more descriptive, too.
  write("gravel_bed.stl", triangle);
  EXPECT_EQ(material_of(sdf(model("m", mesh("gravel_bed.stl")))), "gravel");
}

TEST_F(ImportScene, MissingMeshesOfFuelComeWithTheCommandThatFetchesTheirModel) {
  const Environment home("HOME", files.path("home").string());
  const std::string fuel = "https://fuel.gazebosim.org/1.0/Cole/models/";
  const std::string world =
      sdf(model("a", mesh(fuel + "Coral01/1/files/meshes/c.stl")) + model("b", mesh(fuel + "Coral01/1/files/meshes/d.stl")) +
          model("c", mesh(fuel + "Sea%20Vase/tip/files/v.dae")) + model("d", mesh("gone.stl")));
  EXPECT_THAT(error(world), ::testing::EndsWith("mesh gone.stl; fetch from Fuel: gz fuel download --url '" + fuel +
                                                "Coral01/1'; gz fuel download --url '" + fuel + "Sea%20Vase/tip'"));
  options.read.skip_missing = true;
  const auto done = run(sdf(model("a", mesh(fuel + "Coral01/1/files/meshes/c.stl")) + model("b", mesh("https://x.org/c.stl")) +
                            model("e", link("l"))));
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_THAT(done->left_out,
              ElementsAre(::testing::EndsWith("c.stl: not found; fetch it: gz fuel download --url '" + fuel + "Coral01/1'"),
                          ::testing::EndsWith("https://x.org/c.stl: not found")));
  const auto many =
      run(sdf("<light name='l'/>" + model("p", "<plugin name='p' filename='x.so'/>" + link("l")) +
              model("a", mesh(fuel + "Coral01/1/files/meshes/c.stl")) + model("b", mesh("gone.stl")) +
              model("c", mesh(fuel + "Coral01/1/files/meshes/d.stl")) + model("d", mesh("gone.stl")) + "<include><uri>" + fuel +
              "Kelp</uri></include><include><uri>" + fuel + "kelp</uri><name>k</name></include>"));
  ASSERT_TRUE(many) << many.error().text;
  EXPECT_THAT(
      many->left_out,
      ElementsAre(
          "w.sdf:3: include of " + fuel + "Kelp (2 times): not found; fetch it: gz fuel download --url '" + fuel + "Kelp'",
          ::testing::EndsWith("c.stl (2 times, 2 files): not found; fetch it: gz fuel download --url '" + fuel + "Coral01/1'"),
          ::testing::EndsWith("mesh gone.stl (2 times): not found"), "1 light: without an echo",
          ::testing::EndsWith("plugin \"p\"")));
}

TEST_F(ImportScene, MovingModelsBecomeBodiesAtTheirPoses) {
  options.moving = {"rov"};
  options.offset_m = {0, 0, -5};
  const auto done =
      run(sdf(model("rov", std::string("<pose>1 2 0 0 0 1.5707963267948966</pose>") + link("a", "<pose>1 0 0 0 0 0</pose>"))));
  ASSERT_TRUE(done) << done.error().text;
  const auto made = scene();
  ASSERT_THAT(made->body_names, ElementsAre("rov"));
  expect_near(made->bodies_in_world[0].position_m, {1, 2, -5});
  ASSERT_EQ(made->objects.size(), 2u);
  EXPECT_FALSE(made->objects[0].visible);
  expect_near(made->objects[1].in_world.position_m, {1, 3, -5}, 1e-6);
  options.moving = {"rof"};
  EXPECT_THAT(error(sdf(model("rov", link("l")))), HasSubstr("--moving rof: no model of that name; did you mean \"rov\"?"));
}

TEST_F(ImportScene, AnExistingFileIsReplacedOnlyWithOverwrite) {
  options.overwrite = false;
  EXPECT_EQ(error(sdf(model("m", link("l")))), "no error");
  EXPECT_THAT(error(sdf(model("m", link("l")))), HasSubstr("--overwrite"));
  options.out = files.path("no/such/folder.yaml");
  EXPECT_THAT(error(sdf(model("m", link("l")))), HasSubstr("cannot be written"));
  options.file = files.path("none.sdf");
  EXPECT_EQ(import_scene(options).error().kind, ErrorKind::missing_file);
}

TEST_F(ImportScene, OddNamesAndSizesStillLoad) {
  const auto done =
      run(sdf(model("true", link("a: b # &quot;c&quot; \\")) + model("- 漁船 {x}", link("l")) +
              model("flat",
                    "<link name='l'><visual name='v'><geometry><box><size>1 1e-7 1</size></box></geometry></visual>"
                    "<visual name='v'><geometry><box><size>1 0 1</size></box></geometry></visual>"
                    "<visual name='v'><geometry><sphere><radius>90000</radius></sphere></geometry></visual></link>")));
  ASSERT_TRUE(done) << done.error().text;
  const auto made = scene();
  ASSERT_EQ(made->objects.size(), 4u);
  EXPECT_EQ(made->objects[0].name, "true");
  EXPECT_EQ(made->objects[1].name, "- 漁船 {x}");
  EXPECT_THAT(done->left_out, ElementsAre(HasSubstr("box: size must be greater than 0")));
}

}  // namespace
}  // namespace sonar::scene_tools
