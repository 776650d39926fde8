// Addresses of sonars that the command line replaces, and those of the control interface.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/config/load_config.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::config_addresses_test {
namespace {

using ::testing::HasSubstr;

Result<Config> parse(const std::string& yaml) {
  tests::TemporaryFiles files;
  files.write("scene.yaml", "name: test\n");
  return parse_config(yaml, "sonard.yaml", files.folder());
}

std::string two_sonars(const std::string& first, const std::string& second_ip) {
  return "world: {scene: scene.yaml}\nvehicles: [{name: rov}]\nsonars:\n"
         "  - {name: a, profile: oculus-m1200d, bind_ip: 192.168.2.4" +
         first + "}\n  - {name: b, profile: oculus-m1200d, bind_ip: " + second_ip +
         (second_ip == "0.0.0.0" ? ", advertise_ip: 10.0.0.9}\n" : "}\n");
}

TEST(Rebind, ValuesDerivedFromTheAddressChangeWithIt) {
  auto config = parse(two_sonars("", "192.168.2.5"));
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_EQ(text_of(config->sonars[0].status_to.at(0).ip), "192.168.2.255");
  ASSERT_TRUE(rebind(*config, "127.0.0.9"));
  const SonarConfig& moved = config->sonars[0];
  EXPECT_EQ(text_of(moved.bind_ip), "127.0.0.9");
  EXPECT_EQ(text_of(moved.advertise_ip), "127.0.0.9");
  EXPECT_EQ(text_of(moved.netmask), "255.0.0.0");
  ASSERT_EQ(moved.status_to.size(), 1u);
  EXPECT_EQ(text_of(moved.status_to[0].ip), "127.255.255.255");
  EXPECT_EQ(text_of(config->sonars[1].bind_ip), "192.168.2.5");
  ASSERT_TRUE(rebind(*config, "10.1.2.3"));
  EXPECT_EQ(text_of(moved.netmask), "255.255.255.0");
  EXPECT_EQ(text_of(moved.status_to.at(0).ip), "10.1.2.255");
}

TEST(Rebind, ValuesOfTheFileStay) {
  auto config = parse(two_sonars(", netmask: 255.255.0.0, status_to: [192.168.2.7]", "192.168.2.5"));
  ASSERT_TRUE(config) << config.error().text;
  ASSERT_TRUE(rebind(*config, "10.1.2.3"));
  EXPECT_EQ(text_of(config->sonars[0].netmask), "255.255.0.0");
  EXPECT_EQ(text_of(config->sonars[0].status_to.at(0).ip), "192.168.2.7");
  auto with_mask = parse(two_sonars(", netmask: 255.255.0.0", "192.168.2.5"));
  ASSERT_TRUE(with_mask && rebind(*with_mask, "10.1.2.3"));
  EXPECT_EQ(text_of(with_mask->sonars[0].status_to.at(0).ip), "10.1.255.255");
}

TEST(Rebind, RefusesAddressesThatCannotServe) {
  const auto refusal = [](const std::string& second_ip, const char* address) {
    auto config = parse(two_sonars("", second_ip));
    if (!config) return config.error().text;
    const auto r = rebind(*config, address);
    return r ? std::string("accepted") : r.error().text;
  };
  EXPECT_THAT(refusal("192.168.2.5", "0.0.0.0"), HasSubstr("advertise_ip in a configuration file"));
  EXPECT_THAT(refusal("192.168.2.5", "192.168.2.5"), HasSubstr("already used by sonar \"b\""));
  EXPECT_THAT(refusal("0.0.0.0", "192.168.2.9"), HasSubstr("already used by sonar \"b\""));
  EXPECT_THAT(refusal("192.168.2.5", "localhost"), HasSubstr("not an IPv4 address"));
  EXPECT_EQ(refusal("192.168.2.5", "192.168.2.4"), "accepted") << "the sonar's own address";
}

TEST(ConfigControl, DefaultsAreOnLoopbackAndGiveWay) {
  const auto config = parse(two_sonars("", "192.168.2.5"));
  ASSERT_TRUE(config);
  EXPECT_EQ(text_of(config->control.stream.at), "127.0.0.1:14770");
  EXPECT_EQ(text_of(config->control.http.at), "127.0.0.1:8088");
  EXPECT_FALSE(config->control.stream_given || config->control.http_given);
}

TEST(ConfigControl, ReadsItsKeysAndRefusesStrangersWithoutAToken) {
  const auto with = [](const std::string& control) {
    return parse(two_sonars("", "192.168.2.5") + "control: " + control + "\n");
  };
  const auto config = with("{stream: off, http: '127.0.0.9:0', hosts: [sonar-lab], token_file: secret}");
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_FALSE(config->control.stream.enabled);
  EXPECT_TRUE(config->control.http.enabled && config->control.http_given);
  EXPECT_EQ(text_of(config->control.http.at), "127.0.0.9:0");
  EXPECT_EQ(config->control.hosts.at(0), "sonar-lab");
  EXPECT_EQ(config->control.token_file.filename(), "secret");
  EXPECT_TRUE(with("{http: '0.0.0.0:8088', token_file: /etc/secret}"));
  const auto viewed = with("{view_origins: ['https://a.example', {origin: 'http://b.example:8080', steer: true}]}");
  ASSERT_TRUE(viewed) << viewed.error().text;
  EXPECT_EQ(viewed->control.view_origins,
            (std::vector<ViewOrigin>{{"https://a.example", false}, {"http://b.example:8080", true}}));
  const auto refusal = [&](const std::string& control) {
    const auto c = with(control);
    EXPECT_TRUE(c || c.error().kind == ErrorKind::config);
    return c ? std::string("accepted") : c.error().text;
  };
  for (const char* origin : {"'null'", "'file://'", "https://a.example/page", "a.example", "'https://'"})
    EXPECT_THAT(refusal(std::string("{view_origins: [") + origin + "]}"), HasSubstr("is not an origin")) << origin;
  EXPECT_THAT(refusal("{http: '0.0.0.0:8088'}"), HasSubstr("control.http: can be reached from other computers"));
  EXPECT_THAT(refusal("{stream: '192.168.2.5:14770'}"), HasSubstr("control.token_file"));
  EXPECT_THAT(refusal("{stream: '127.0.0.1:8088', http: '127.0.0.1:8088'}"), HasSubstr("the same address as control.stream"));
  EXPECT_THAT(refusal("{htpp: off}"), HasSubstr("did you mean \"http\""));
  EXPECT_THAT(refusal("{http: '127.0.0.1'}"), HasSubstr("is not an address"));
}

}  // namespace
}  // namespace sonar::config_addresses_test
