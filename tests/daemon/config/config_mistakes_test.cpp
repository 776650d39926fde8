// Common mistakes in a configuration: the error names the probable intention, not only the mistake.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "daemon/config/load_config.hpp"
#include "daemon/config/products.hpp"

namespace sonar::config_mistakes_test {
namespace {

using ::testing::HasSubstr;

/// Folder of this test process.
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

TEST(ConfigMistakes, NamesTheNearestSceneForAnUnknownName) {
  std::ofstream(directory() + "/harbour.yaml") << "objects: []\n";
  std::ofstream(directory() + "/harbours.yaml") << "world: {scene: harbour.yaml}\nobjects: []\nsonars: []\n";  // not a scene
  const auto refusal = [&](const std::string& scene) { return why("world: {scene: " + scene + "}\n" + vehicles + sonar); };
  EXPECT_THAT(refusal("harbuors.yaml"), HasSubstr("no such file: \"harbuors.yaml\"; did you mean \"harbour.yaml\"? Looked in "));
  EXPECT_THAT(refusal("demoo.yaml"), HasSubstr("did you mean \"demo.yaml\"?"));  // a built-in scene
  EXPECT_THAT(refusal("local-search"), HasSubstr("did you mean \"local-search.yaml\"?"));
  EXPECT_THAT(refusal("scenes/demo.yml"), HasSubstr("did you mean \"demo.yaml\"?"));
}

TEST(ConfigMistakes, NamesTheKindOfAnUnreadableSceneFile) {
  ASSERT_EQ(mkfifo((directory() + "/fifo.yaml").c_str(), 0600), 0);
  EXPECT_THAT(why("world: {scene: fifo.yaml}\n" + vehicles + sonar), HasSubstr("fifo.yaml: is a FIFO, not a regular file"));
}

TEST(ConfigMistakes, SaysWhyAnExistingFileCannotBeRead) {
  namespace fs = std::filesystem;
  const fs::path folder = directory();
  fs::create_directory(folder / "maps.yaml");
  fs::create_symlink("round.yaml", folder / "round.yaml");
  fs::create_symlink("gone", folder / "link.yaml");
  const std::pair<const char*, const char*> cases[] = {
      {"maps.yaml", "maps.yaml: is a folder, not a regular file; name a file in it"},
      {"round.yaml", "round.yaml: cannot be opened: its links lead round in a circle"},
      {"link.yaml", "link.yaml: cannot be opened: it is a link to \"gone\", which does not exist"}};
  for (const auto& [name, words] : cases) {
    EXPECT_THAT(why(std::string("world: {scene: ") + name + "}\n" + vehicles + sonar), HasSubstr(words));
    EXPECT_THAT(why(world + "vehicles: [{name: a, trajectory: {file: " + name + "}}]\n" + sonar), HasSubstr(words));
    EXPECT_THAT(why(world + "vehicles: [{name: a, trajectory: " + name + "}]\n" + sonar), HasSubstr(words));
    EXPECT_THAT(load_config(folder / name).error().text, HasSubstr(words));
  }
  for (const char* name : {"maps.yaml", "round.yaml", "link.yaml"}) fs::remove(folder / name);
}

TEST(ConfigMistakes, ListenersAtMulticastAndBroadcastAddressesAreRefused) {
  for (const std::string ip : {"224.0.0.1", "239.255.0.1", "255.255.255.255", "240.0.0.1", "127.255.255.255"}) {
    const std::string words = ": " + ip + " is a multicast, broadcast or reserved address; give an address of this computer";
    const auto with = [&](const std::string& more) { return why(world + vehicles + sonar + more); };
    for (const char* key : {"protobuf", "json"})
      EXPECT_THAT(with(std::string("poses: {allow_from: [10.0.0.0/8], ") + key + ": '" + ip + ":14990'}\n"),
                  HasSubstr(std::string("poses.") + key + words));
    EXPECT_THAT(with("poses: {allow_from: [10.0.0.0/8], mavlink: 'udpin:" + ip + ":14551'}\n"),
                HasSubstr("poses.mavlink" + words));
    EXPECT_EQ(with("poses: {mavlink: 'udpout:" + ip + ":14551'}\n"), "accepted") << "a destination";
    for (const char* key : {"stream", "http"})
      EXPECT_THAT(with(std::string("control: {token_file: t, ") + key + ": '" + ip + ":14990'}\n"),
                  HasSubstr(std::string("control.") + key + words));
    EXPECT_THAT(why(world + vehicles + "sonars: [{name: a, profile: oculus-m1200d, bind_ip: " + ip + "}]\n"),
                HasSubstr("sonars[0].bind_ip" + words));
    EXPECT_EQ(with("    status_to: ['" + ip + "']\n"), "accepted") << "a destination";
    auto config = parse_config(world + vehicles + sonar, "sonard.yaml", directory());
    ASSERT_TRUE(config);
    const auto moved = rebind(*config, ip);
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().kind, ErrorKind::usage);
    EXPECT_THAT(moved.error().text, HasSubstr(words.substr(2)));
  }
  EXPECT_THAT(why(world + vehicles + sonar + "control: {stream: '[ff02::1]:14990'}\n"), HasSubstr("is not an address"));
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

/// Returns the shipped example with another product, and nothing else changed.
Result<Config> example_with(const std::string& profile) {
  std::ifstream file(std::filesystem::path(SONARD_SOURCE_DIR) / "scenes/sonard.yaml");
  std::string text(std::istreambuf_iterator<char>(file), {});
  const std::string theirs = "profile: oculus-m1200d";
  text.replace(text.find(theirs), theirs.size(), "profile: " + profile);
  return parse_config(text, "sonard.yaml", std::filesystem::path(SONARD_SOURCE_DIR) / "scenes");
}

TEST(ConfigMistakes, AnotherProductAloneLeavesTheExampleValid) {
  for (const protocol::Vendor* vendor : protocol::vendors())
    for (const auto& model : vendor->models()) {
      const auto config = example_with(model->profile);
      ASSERT_TRUE(config) << config.error().text;
      EXPECT_EQ(config->sonars.at(0).profile.model->name, model->name);
      EXPECT_EQ(config->sonars.at(0).max_clients, vendor->default_max_clients());
    }
}

TEST(ConfigMistakes, OptionsOfAnotherVendorAreReported) {
  EXPECT_THAT(notes_of_config(*example_with("oculus-m750d")), ::testing::IsEmpty());
  EXPECT_THAT(
      notes_of_config(*example_with("blueview-p900-90")),
      ::testing::ElementsAre("sonar front: options.before_first_fire is for Oculus sonars: without effect on BlueView P900-90",
                             "sonar front: options.gain_echo is for Oculus sonars: without effect on BlueView P900-90"));
  const auto oculus = parse_config(world + vehicles + sonar + "    options: {heads_base: strict}\n", "sonard.yaml", directory());
  ASSERT_TRUE(oculus) << oculus.error().text;
  EXPECT_THAT(notes_of_config(*oculus),
              ::testing::ElementsAre("sonar front: options.heads_base is for BlueView sonars: without effect on Oculus M1200d"));
}

TEST(ConfigMistakes, UnknownOptionsAreRefusedWithTheKnownOnes) {
  const auto with = [](const std::string& options) {
    return why(world + vehicles + "sonars:\n  - {name: a, profile: blueview-p900-90, bind_ip: 127.0.0.2, options: {" + options +
               "}}\n");
  };
  EXPECT_THAT(with("before_frist_fire: pings"),
              ::testing::AllOf(HasSubstr("sonars[0].options.before_frist_fire: unknown key"), HasSubstr("heads_base")));
  EXPECT_THAT(with("strict_rnage: on"), HasSubstr("did you mean \"strict_range\"?"));
  EXPECT_THAT(with("before_first_fire: pigns"), HasSubstr("did you mean \"pings\"?"));  // an option of another make
}

TEST(ConfigMistakes, TheDemoAcceptsAnyProduct) {
  for (const protocol::Vendor* vendor : protocol::vendors())
    for (const auto& model : vendor->models()) {
      auto config = demo_config();
      ASSERT_TRUE(config);
      const auto used = use_product(*config, model->profile);
      ASSERT_TRUE(used) << used.error().text;
      const SonarConfig& first = config->sonars.at(0);
      EXPECT_EQ(first.profile.vendor, vendor);
      EXPECT_EQ(first.profile.model->name, model->name);
      EXPECT_EQ(first.max_clients, vendor->default_max_clients());
      EXPECT_EQ(first.options, *protocol::check_options(*vendor, {}));
    }
  auto config = demo_config();
  const auto refused = use_product(*config, "blueview-p900");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
  EXPECT_THAT(refused.error().text,
              ::testing::AllOf(HasSubstr("blueview-p900-90"), HasSubstr("oculus-m370s"), HasSubstr("blueview-mb2250-90")));
}

TEST(ConfigMistakes, PointsRenderFilesToTheirCommand) {
  const auto config = parse_config("scene: demo.yaml\nsonar: {}\n", "r.yaml", {});
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().kind, ErrorKind::config);
  EXPECT_THAT(config.error().text, ::testing::HasSubstr("sonard render r.yaml"));
}

TEST(ConfigMistakes, PointsADataSetsJobToItsCommand) {
  const auto config = load_config(std::filesystem::path(SONARD_SOURCE_DIR) / "scenes/datasets/mines.yaml");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().kind, ErrorKind::config);
  EXPECT_THAT(config.error().text, HasSubstr("this is a data set's job, not a configuration: sonard dataset "));
}

TEST(ConfigMistakes, AScenePassedAsConfigurationIsNamed) {
  const auto config = load_config(std::filesystem::path(SONARD_SOURCE_DIR) / "scenes/tank-rod.yaml");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().kind, ErrorKind::config);
  EXPECT_THAT(config.error().text, HasSubstr("tank-rod.yaml: this looks like a scene, not a configuration"));
  EXPECT_THAT(config.error().text, HasSubstr("world: {scene: FILE}"));
  EXPECT_THAT(why(vehicles + sonar + "objects: []\n"), HasSubstr("world: required key"));  // a configuration without a scene
}

}  // namespace
}  // namespace sonar::config_mistakes_test
