// A preview in virtual time: its rate, its end, and that a preview does not change the bytes for the first driver.
#include "daemon/emulator/view/ping_payloads.hpp"

#include <gmock/gmock.h>

#include "tests/daemon/emulator/sonar/virtual_time.hpp"

namespace sonar {
namespace {

using namespace testing_emulator;
using std::chrono::milliseconds;

struct Story {
  std::vector<PingRequest> shown;
  protocol::Bytes driver;
  std::uint64_t pings = 0;
  std::string end;
};

Story story_of(bool with_preview) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  Sonar& sonar = time.sonar("front");
  Preview preview;
  if (with_preview) preview.begin(time.now);
  Story story;
  const auto look = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      time.run(milliseconds(100));
      if (preview.on() && preview.why_over(sonar, time.now).empty())
        if (auto request = preview.due(sonar, time.now)) {
          story.shown.push_back(*request);
          preview.done(true);
        }
    }
  };
  look(50);
  const ConnectionId client = time.connect("front");
  time.send(client, fire());
  look(30);
  story.end = preview.on() ? preview.why_over(sonar, time.now) : "";
  story.driver = time.clients[client].received;
  story.pings = sonar.pings();
  return story;
}

TEST(Preview, TheFirstDriverGetsTheSameBytesAsWithoutAPreview) {
  const Story with = story_of(true), without = story_of(false);
  EXPECT_EQ(with.shown.size(), 25u) << "5 per second, and none once a driver is connected";
  EXPECT_TRUE(without.shown.empty());
  EXPECT_EQ(with.driver, without.driver);
  EXPECT_EQ(with.pings, without.pings);
  EXPECT_EQ(ping_numbers(with.driver).at(0), 1u);
  EXPECT_EQ(with.end, "a driver is connected");
}

TEST(Preview, HasNumbersAndNoiseOfItsOwn) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2") + oculus_sonar("left", "127.0.0.3")));
  std::set<std::uint32_t> noise;
  for (const Sonar& sonar : time.sonars) {
    noise.insert(sonar.index());
    Preview preview;
    EXPECT_FALSE(preview.due(sonar, time.now)) << "off";
    preview.begin(time.now);
    const auto first = preview.due(sonar, time.now);
    ASSERT_TRUE(first);
    noise.insert(first->sonar_id);
    EXPECT_EQ(static_cast<std::uint32_t>(first->number), 1u);
    EXPECT_FALSE(preview.due(sonar, time.now + milliseconds(200))) << "the first ping is being computed";
    preview.done(true);
    EXPECT_FALSE(preview.due(sonar, time.now + milliseconds(199)));
    const auto second = preview.due(sonar, time.now + milliseconds(200));
    ASSERT_TRUE(second);
    EXPECT_EQ(static_cast<std::uint32_t>(second->number), 2u);
    EXPECT_EQ(second->fired_at, time.now + milliseconds(200));
    EXPECT_EQ(preview.why_over(sonar, time.now + std::chrono::seconds(599)), "");
    EXPECT_EQ(preview.why_over(sonar, time.now + std::chrono::seconds(600)), "after 600 s");
  }
  EXPECT_EQ(noise.size(), 4u);
}

TEST(Preview, MeasuresItsRateFromThePingsThatWereMade) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  const Sonar& sonar = time.sonar("front");
  Preview preview;
  const auto run = [&](int pings, bool made) {
    preview.begin(time.now);
    for (int n = 0; n < pings; ++n) {
      ASSERT_TRUE(preview.due(sonar, time.now));
      preview.done(made);
      time.now += milliseconds(250);
    }
  };
  run(3, false);
  EXPECT_EQ(preview.hz(time.now), 0) << "the engine made no ping";
  run(8, true);
  EXPECT_NEAR(preview.hz(time.now), 4, 1e-9);
  preview.end();
  EXPECT_EQ(preview.hz(time.now), 0);
  time.now += std::chrono::seconds(1);
  run(2, true);
  EXPECT_NEAR(preview.hz(time.now), 4, 1e-9) << "the pause does not count";
}

}  // namespace
}  // namespace sonar
