// Compares the beams of each product and lens with facts of the vendor's published tables: edges, spacing, side.
#include "core/base/geometry.hpp"
#include "tests/protocol/aris/aris_testing.hpp"

namespace sonar::aris {
namespace {

TEST(ArisModels, EachProductHasItsModes) {
  for (const auto& [profile, modes] :
       {std::pair{"aris-1200", std::size_t{4}}, {"aris-1800", std::size_t{8}}, {"aris-3000", std::size_t{4}}}) {
    const auto model = protocol::find_profile(profile)->model;
    ASSERT_EQ(model->modes.size(), modes);
    const Product& product = product_of(*model);
    for (int i = 0; i < static_cast<int>(modes); ++i) {
      const ModeChoice choice = choice_of(product, i);
      EXPECT_EQ(mode_index(product, choice), i);
      const FrequencyMode& mode = model->modes[static_cast<std::size_t>(i)];
      EXPECT_EQ(static_cast<int>(mode.beam_azimuths_rad.size()), find_ping_mode(product, choice.ping_mode)->beams());
    }
    EXPECT_FALSE(mode_index(product, {2, Frequency::high, false}));
  }
  EXPECT_FALSE(mode_index(product_of(*protocol::find_profile("aris-3000")->model), {9, Frequency::high, true}));
}

TEST(ArisModels, BeamsFillTheSectorFromPortToStarboard) {
  struct Row {
    const char* profile;
    int beams;
    bool telephoto;
    double edge_deg, error_deg;
  };
  for (const Row& row : {Row{"aris-3000", 128, false, 15.12, 0.03}, Row{"aris-3000", 64, false, 15.12, 0.03},
                         Row{"aris-1200", 48, false, 13.79, 0.15}, Row{"aris-1800", 96, false, 13.92, 0.2},
                         Row{"aris-1200", 48, true, 7.49, 0.05}, Row{"aris-1800", 96, true, 7.49, 0.05}}) {
    const auto azimuths = beam_azimuths(product_of(*protocol::find_profile(row.profile)->model), row.beams, row.telephoto);
    ASSERT_EQ(static_cast<int>(azimuths.size()), row.beams);
    for (std::size_t j = 1; j < azimuths.size(); ++j) EXPECT_LT(azimuths[j], azimuths[j - 1]);
    EXPECT_NEAR(azimuths.front(), -azimuths.back(), 1e-12);
    const double edge = azimuths[0] + (azimuths[0] - azimuths[1]) / 2;
    EXPECT_NEAR(deg_from_rad(edge), row.edge_deg, row.error_deg) << row.profile << row.beams;
  }
}

}  // namespace
}  // namespace sonar::aris
