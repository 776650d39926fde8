#include "protocol/blueview/models.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::blueview {
namespace {

TEST(BlueViewModels, EveryHeadHasAPresetThatTheEngineAccepts) {
  std::set<std::string> profiles;
  for (const auto& model : models()) {
    EXPECT_TRUE(profiles.insert(model->profile).second) << model->profile;
    const auto presets = head_presets(model->profile);
    ASSERT_EQ(presets.size(), model->modes.size()) << model->profile;
    const auto device = test::device(model->profile);
    SonarSettings all = initial_sonar_settings(device);
    for (std::size_t i = 0; i < presets.size(); ++i) {
      all.active_head = static_cast<std::int32_t>(i);
      const PingSettings s = ping_settings(all, device);
      EXPECT_EQ(s.mode, static_cast<int>(i));
      EXPECT_GT(s.range_bin_count, 0);
      EXPECT_LE(presets[i].stop_m, static_cast<double>(model->modes[i].max_range_m));
      EXPECT_GE(presets[i].start_m, static_cast<double>(model->modes[i].min_range_m));
      EXPECT_LT(model->name.size(), 20u) << model->name << ": hosts reserve 20 bytes";
    }
  }
  for (const char* family : {"p450", "p900", "m450", "m900", "m900-2250", "mb1350", "mb2250"})
    EXPECT_TRUE(std::any_of(profiles.begin(), profiles.end(), [&](const std::string& p) {
      return p.starts_with(std::string("blueview-") + family);
    })) << family;
}

}  // namespace
}  // namespace sonar::blueview
