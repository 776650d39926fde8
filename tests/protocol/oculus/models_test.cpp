// Compares the product table with the figures of public drivers, which were typed a second time here.
#include <set>

#include "protocol/oculus/models.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

struct Expected {
  const char* profile;
  int part_number;
  std::size_t mode;
  double centre_hz, max_range_m, aperture_deg, azimuth_deg, elevation_deg, min_range_m;
};

TEST(Models, HaveTheValuesOfTheTable) {
  const Expected table[] = {
      {"oculus-m370s", 1041, 0, 370e3, 200, 130, 2.0, 20, 0.2},    {"oculus-c550d", 4713, 0, 550e3, 100, 120, 1.0, 20, 0.2},
      {"oculus-c550d", 4713, 1, 820e3, 30, 90, 0.7, 20, 0.2},      {"oculus-m750d", 1032, 0, 750e3, 120, 130, 1.0, 20, 0.1},
      {"oculus-m750d", 1032, 1, 1.2e6, 40, 130, 0.6, 20, 0.1},     {"oculus-m750d-hf130", 1032, 1, 1.2e6, 40, 130, 0.6, 20, 0.1},
      {"oculus-m750d-hf12", 1032, 1, 1.2e6, 40, 70, 0.6, 12, 0.1}, {"oculus-m1200d", 1042, 0, 1.2e6, 40, 130, 0.6, 20, 0.1},
      {"oculus-m1200d", 1042, 1, 2098880.6, 10, 60, 0.4, 12, 0.1}, {"oculus-m3000d", 2203, 0, 1.2e6, 30, 130, 0.6, 20, 0.1},
      {"oculus-m3000d", 2203, 1, 3.0e6, 5, 40, 0.25, 20, 0.1},
  };
  for (const Expected& row : table) {
    const auto profile = protocol::find_profile(row.profile);
    ASSERT_TRUE(profile.has_value()) << row.profile;
    ASSERT_GT(profile->model->modes.size(), row.mode) << row.profile;
    const FrequencyMode& mode = profile->model->modes[row.mode];
    EXPECT_EQ(profile->model->part_number, row.part_number) << row.profile;
    EXPECT_NEAR(mode.centre_hz, row.centre_hz, 0.2) << row.profile;
    EXPECT_FLOAT_EQ(mode.max_range_m, static_cast<float>(row.max_range_m)) << row.profile;
    EXPECT_NEAR(deg_from_rad(mode.horizontal_aperture_rad), row.aperture_deg, 1e-4) << row.profile;
    EXPECT_NEAR(deg_from_rad(mode.pattern.azimuth_width_rad), row.azimuth_deg, 1e-5) << row.profile;
    EXPECT_NEAR(deg_from_rad(mode.pattern.elevation_width_rad), row.elevation_deg, 1e-5) << row.profile;
    EXPECT_FLOAT_EQ(mode.min_range_m, static_cast<float>(row.min_range_m)) << row.profile;
    EXPECT_EQ(mode.source_level_db, 200) << row.profile;
    const bool fitted_to_the_capture = row.part_number == 1042 && row.mode == 1;
    EXPECT_EQ(mode.receiver.noise_figure_db, fitted_to_the_capture ? 14.6f : 10) << row.profile;
  }
}

TEST(Models, SingleFrequencyProductsHaveOneMode) {
  EXPECT_EQ(protocol::find_profile("oculus-m370s")->model->modes.size(), 1u);
  EXPECT_EQ(protocol::find_profile("oculus-m1200d")->model->modes.size(), 2u);
}

TEST(Models, EveryPublicPartNumberHasAProfile) {
  std::set<int> have;
  for (const auto& model : models()) have.insert(model->part_number);
  for (const int number : {1032, 1041, 1042, 1134, 1135, 1209, 1217, 1218, 1219, 1220, 1221, 1228, 1229, 1244, 1433, 1434,
                           1435, 1436, 1437, 2466, 2924, 1921, 2086, 2294, 2203, 2599, 2658, 2659, 2418, 2419, 2420, 4713})
    EXPECT_TRUE(have.contains(number)) << number;
}

Result<std::shared_ptr<const SonarModel>> tuned(const char* profile, const protocol::OptionValues& given) {
  const auto found = protocol::find_profile(profile).value();
  return found.vendor->tuned(found.model, protocol::check_options(*found.vendor, given).value());
}

TEST(Tuning, WithoutOptionsTheModelIsThatOfTheProduct) {
  EXPECT_EQ(tuned("oculus-m1200d", {}).value(), protocol::find_profile("oculus-m1200d")->model);
  EXPECT_EQ(tuned("oculus-m1200d", {{"lf_aperture_deg", "product"}}).value(), protocol::find_profile("oculus-m1200d")->model);
}

TEST(Tuning, EveryFigureReachesItsMode) {
  const auto model = tuned("oculus-c550d", {{"lf_aperture_deg", "130"},
                                            {"hf_aperture_deg", "80"},
                                            {"lf_azimuth_width_deg", "1.2"},
                                            {"hf_azimuth_width_deg", "0.8"},
                                            {"lf_elevation_width_deg", "25"},
                                            {"hf_elevation_width_deg", "15"},
                                            {"elevation_width_is", "one_way"}})
                         .value();
  ASSERT_EQ(model->modes.size(), 2u);
  const double expected[2][3] = {{130, 1.2, 25}, {80, 0.8, 15}};
  for (std::size_t i = 0; i < 2; ++i) {
    const FrequencyMode& mode = model->modes[i];
    EXPECT_NEAR(deg_from_rad(mode.horizontal_aperture_rad), expected[i][0], 1e-4) << mode.name;
    EXPECT_NEAR(deg_from_rad(mode.pattern.azimuth_width_rad), expected[i][1], 1e-5) << mode.name;
    EXPECT_NEAR(deg_from_rad(mode.pattern.elevation_width_rad), expected[i][2], 1e-5) << mode.name;
    EXPECT_EQ(mode.pattern.elevation_width_is, ElevationWidthIs::one_way) << mode.name;
  }
  EXPECT_EQ(model->part_number, 4713);
  const FrequencyMode& shared = protocol::find_profile("oculus-c550d")->model->modes[0];
  EXPECT_NEAR(deg_from_rad(shared.horizontal_aperture_rad), 120, 1e-4) << "the shared model of the product keeps its aperture";
}

TEST(Tuning, ImpossibleValuesAreRefused) {
  const auto& vendor = *protocol::vendors().front();
  EXPECT_EQ(protocol::check_options(vendor, {{"hf_aperture_deg", "180"}}).error().text,
            "option hf_aperture_deg must be a number from 5 to 170, not '180'");
  EXPECT_EQ(tuned("oculus-m370s", {{"hf_aperture_deg", "60"}}).error().text,
            "option hf_aperture_deg: Oculus M370s has one frequency only, set the lf_ figure instead");
  EXPECT_TRUE(tuned("oculus-m370s", {{"lf_aperture_deg", "60"}}).has_value());
}

TEST(Models, AllAreUsable) {
  for (const auto& model : models()) {
    EXPECT_FALSE(model->modes.empty()) << model->profile;
    for (const FrequencyMode& mode : model->modes) {
      EXPECT_GT(mode.centre_hz, 0) << model->profile;
      EXPECT_GT(mode.receiver.full_scale_upa, 1) << model->profile;
      EXPECT_LT(mode.min_range_m, mode.max_range_m) << model->profile;
    }
  }
}

}  // namespace
}  // namespace sonar::oculus::tests
