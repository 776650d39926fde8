// Mistakes of the first hour in a configuration: what is meant is named, not only that something is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "daemon/config/config.hpp"

namespace sonar {
namespace {

using ::testing::HasSubstr;

/// Of this test process.
struct Folder {
  Folder() {
    std::string pattern = ::testing::TempDir() + "/mistakesXXXXXX";
    path = mkdtemp(pattern.data());
    std::ofstream(path / "scene.yaml") << "name: test\n";
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};
std::string directory() {
  static const Folder folder;
  return folder.path.string();
}
std::string why(const std::string& yaml) {
  const auto config = parse_config(yaml, "sonard.yaml", directory());
  return config ? "accepted" : config.error().text;
}

const std::string world = "world: {scene: scene.yaml}\n";
const std::string vehicles = "vehicles: [{name: rov}]\n";
const std::string sonar = "sonars:\n  - name: front\n    profile: oculus-m1200d\n    bind_ip: 127.0.0.2\n";

TEST(ConfigMistakes, NamesTheNearestSceneToOneThatIsNot) {
  std::ofstream(directory() + "/harbour.yaml") << "objects: []\n";
  std::ofstream(directory() + "/harbours.yaml") << "world: {scene: harbour.yaml}\nobjects: []\nsonars: []\n";  // no scene
  const auto refusal = [&](const std::string& scene) { return why("world: {scene: " + scene + "}\n" + vehicles + sonar); };
  EXPECT_THAT(refusal("harbuors.yaml"), HasSubstr("no such file: \"harbuors.yaml\"; did you mean \"harbour.yaml\"? Looked in "));
  EXPECT_THAT(refusal("demoo.yaml"), HasSubstr("did you mean \"demo.yaml\"?"));  // part of the program
  EXPECT_THAT(refusal("local-search"), HasSubstr("did you mean \"local-search.yaml\"?"));
  EXPECT_THAT(refusal("scenes/demo.yml"), HasSubstr("did you mean \"demo.yaml\"?"));
}

TEST(ConfigMistakes, NamesAMistypedKeyThatSeveralSonarsShare) {
  const auto two_with = [&](const std::string& key) {
    const std::string rest = "profile: oculus-m1200d, " + key + ": 127.0.0.";
    return why(world + vehicles + "sonars:\n  - {name: a, " + rest + "2}\n  - {name: b, " + rest + "3}\n");
  };
  EXPECT_THAT(two_with("bind_ipp"), HasSubstr("did you mean \"bind_ip\"?"));
  EXPECT_THAT(why(world + vehicles + "sonars:\n  - {nmae: a, profile: oculus-m1200d, bind_ip: 127.0.0.2}\n" +
                  "  - {nmae: b, profile: oculus-m1200d, bind_ip: 127.0.0.3}\n"),
              HasSubstr("did you mean \"name\"?"));
  EXPECT_THAT(why(world + "vehicles: [{nmae: a}, {nmae: b}]\n" + sonar), HasSubstr("did you mean \"name\"?"));
}

TEST(ConfigMistakes, PointsRenderFilesToTheirCommand) {
  const auto config = parse_config("scene: demo.yaml\nsonar: {}\n", "r.yaml", {});
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().kind, ErrorKind::config);
  EXPECT_THAT(config.error().text, ::testing::HasSubstr("sonard render r.yaml"));
}

TEST(ConfigMistakes, KnowsAScene) {
  const auto config = load_config(std::filesystem::path(SONARD_SOURCE_DIR) / "scenes/tank-rod.yaml");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().kind, ErrorKind::config);
  EXPECT_THAT(config.error().text, HasSubstr("tank-rod.yaml: this looks like a scene, not a configuration"));
  EXPECT_THAT(config.error().text, HasSubstr("world: {scene: FILE}"));
  EXPECT_THAT(why(vehicles + sonar + "objects: []\n"), HasSubstr("world: required key"));  // a configuration that lacks one
}

}  // namespace
}  // namespace sonar
