// Scenes by name. The built-in scenes are equal to the shipped ones and need no files.
#include "daemon/config/scene_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "core/scene/files/built_in_scenes.hpp"
#include "daemon/config/load_config.hpp"

namespace sonar {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path scenes = std::filesystem::path(SONARD_SOURCE_DIR) / "scenes";

/// A folder of this test process, which is the working directory as long as this object exists.
class EmptyFolder {
 public:
  EmptyFolder() : before_(std::filesystem::current_path()) {
    std::string pattern = ::testing::TempDir() + "/sceneXXXXXX";
    path = mkdtemp(pattern.data());
    std::filesystem::current_path(path);
  }
  ~EmptyFolder() {
    std::filesystem::current_path(before_);
    std::filesystem::remove_all(path);
  }
  EmptyFolder(const EmptyFolder&) = delete;
  EmptyFolder& operator=(const EmptyFolder&) = delete;
  std::filesystem::path path;

 private:
  std::filesystem::path before_;
};

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST(SceneFile, BuiltInScenesAreTheShippedOnesAndReadNoFiles) {
  const EmptyFolder here;
  for (const std::string_view name : built_in_scenes) {
    const auto built_in = load_built_in_scene(name);
    ASSERT_TRUE(built_in) << built_in.error().text;
    const auto shipped = load_scene(scenes / name);
    ASSERT_TRUE(shipped) << shipped.error().text;
    const Scene &a = **built_in, &b = **shipped;
    EXPECT_EQ(a.name, b.name);
    ASSERT_EQ(a.objects.size(), b.objects.size());
    ASSERT_EQ(a.materials.size(), b.materials.size());
    for (std::size_t i = 0; i < a.materials.size(); ++i) EXPECT_EQ(a.materials[i].name, b.materials[i].name);
    for (std::size_t i = 0; i < a.objects.size(); ++i) {
      EXPECT_EQ(a.objects[i].name, b.objects[i].name);
      EXPECT_TRUE(same_bytes(a.objects[i].mesh->vertices, b.objects[i].mesh->vertices)) << a.objects[i].name;
      EXPECT_TRUE(same_bytes(a.objects[i].mesh->triangles, b.objects[i].mesh->triangles)) << a.objects[i].name;
      EXPECT_EQ(a.objects[i].mesh->material, b.objects[i].mesh->material) << a.objects[i].name;
    }
  }
}

TEST(SceneFile, OnlyScenesAreBuiltIn) {
  EXPECT_FALSE(load_built_in_scene("meshes/wreck.obj"));
  EXPECT_THAT(load_built_in_scene("nowhere.yaml").error().text, HasSubstr("nowhere.yaml"));
}

TEST(SceneFile, AFileOnDiskComesBeforeTheBuiltInScene) {
  const EmptyFolder here;
  std::ofstream(here.path / "demo.yaml") << "name: mine\nobjects: [{name: a, type: sphere, radius_m: 1, material: sand}]\n";
  const auto mine = find_scene("demo.yaml", here.path);
  ASSERT_TRUE(mine);
  EXPECT_FALSE(mine->built_in);
  EXPECT_EQ(mine->path, here.path / "demo.yaml");
  EXPECT_EQ((*load_scene(*mine))->name, "mine");
  const auto shipped = find_scene("tank-rod.yaml", here.path);
  ASSERT_TRUE(shipped);
  EXPECT_EQ(shipped->path, scenes / "tank-rod.yaml");
  EXPECT_FALSE(find_scene("nowhere.yaml", here.path));
}

TEST(SceneFile, OnlyTheConfigurationsFolderAndTheShippedScenesMayBeQuoted) {
  const EmptyFolder here, elsewhere;
  std::ofstream(elsewhere.path / "secret.yaml") << "password\n";
  std::ofstream(here.path / "mine.yaml") << "name: mine\n";
  std::filesystem::create_symlink(elsewhere.path / "secret.yaml", here.path / "link.yaml");
  std::filesystem::current_path(here.path);
  EXPECT_TRUE(may_be_quoted({here.path / "mine.yaml"}, here.path));
  EXPECT_TRUE(may_be_quoted({"mine.yaml"}, {})) << "a configuration named without a folder is in the working directory";
  EXPECT_TRUE(may_be_quoted({scenes / "tank-rod.yaml"}, here.path));
  EXPECT_TRUE(may_be_quoted({"demo.yaml", true}, here.path));
  EXPECT_FALSE(may_be_quoted({elsewhere.path / "secret.yaml"}, here.path));
  EXPECT_FALSE(may_be_quoted({here.path / "link.yaml"}, here.path));
  EXPECT_FALSE(may_be_quoted({here.path / ".." / elsewhere.path.filename() / "secret.yaml"}, here.path));
  EXPECT_FALSE(may_be_quoted({elsewhere.path / "secret.yaml"}, "/")) << "a file below /, the working directory of a service";
}

TEST(SceneFile, NamesOfScenesEndInYamlOrYml) {
  for (const char* name : {"demo.yaml", "/a/b.yml", "../c.yaml"}) EXPECT_TRUE(has_scene_name(name)) << name;
  for (const char* name : {"", "/etc/passwd", "token", ".yaml", "a.yaml/b", "a.yaml.txt"})
    EXPECT_FALSE(has_scene_name(name)) << name;
}

TEST(SceneFile, TheDemoRunsOverTheBuiltInSceneWhateverFilesThereAre) {
  const EmptyFolder here;
  std::ofstream(here.path / "demo.yaml") << "name: mine\n";
  const auto demo = demo_config();
  ASSERT_TRUE(demo) << demo.error().text;
  EXPECT_TRUE(demo->scene.built_in);
  EXPECT_EQ((*load_scene(demo->scene))->name, "harbour");
}

}  // namespace
}  // namespace sonar
