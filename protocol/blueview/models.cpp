#include "protocol/blueview/models.hpp"

#include <algorithm>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::blueview {
namespace {

// Sources. P25: Choi et al. 2025, tables 1 and 2. DS: figures of the P900 data sheet that a public note on IOES-Lab/dave quotes.
// NPS: the public model files of nps_uw_multibeam_sonar. UUV: the model files of uuv_simulator. Rows without a source are
// recalled from data sheets and not verified; all beams are about 1 degree wide, more than five times their spacing. unknown:
// source levels (P25's Table 2 has 220 dB for the P900 it simulates; its fit, 170 dB, is of an Oculus), noise figures, full
// scale, tapers, vertical widths of the MB heads' transmitters.
constexpr double inch = 0.0254;

struct Head {
  const char* name;
  double khz, aperture_deg, vertical_deg;
  double min_m, max_m;
  HeadPreset preset;
};
struct Product {
  const char *profile, *name;
  double max_rate_hz;
  std::vector<Head> heads;
};

const std::vector<Product>& products() {
  static const std::vector<Product> all{
      // P25, DS, NPS: 900 kHz, 90 x 20 deg, 512 beams of 1 deg 0.18 deg apart, one inch, 15 Hz; unknown: range (DS: optimum 2 m)
      {"blueview-p900-90", "BlueView P900-90", 15, {{"900 kHz", 900, 90, 20, 0.5, 100, {512, inch, 2, 10, true}}}},
      {"blueview-p450-45", "BlueView P450-45", 10, {{"450 kHz", 450, 45, 15, 1, 137, {256, 0.051, 2, 40, false}}}},
      {"blueview-p450-90", "BlueView P450-90", 10, {{"450 kHz", 450, 90, 15, 1, 137, {512, 0.051, 2, 40, false}}}},
      {"blueview-p450-130", "BlueView P450-130", 10, {{"450 kHz", 450, 130, 15, 1, 137, {768, 0.051, 2, 40, false}}}},
      {"blueview-p900-45", "BlueView P900-45", 15, {{"900 kHz", 900, 45, 20, 0.5, 100, {256, inch, 2, 10, false}}}},
      {"blueview-p900-130", "BlueView P900-130", 15, {{"900 kHz", 900, 130, 20, 0.5, 100, {768, inch, 2, 10, false}}}},
      // NPS: 450 kHz, 88.6 x 10 deg, 512 beams, 2-150 m, 10 Hz
      {"blueview-m450-90", "BlueView M450-90", 10, {{"450 kHz", 450, 88.6, 10, 2, 150, {512, 0.051, 2, 40, true}}}},
      // UUV: 130 deg, 768 beams, 25 Hz
      {"blueview-m450-130", "BlueView M450-130", 25, {{"450 kHz", 450, 130, 10, 1, 150, {768, 0.051, 2, 40, true}}}},
      {"blueview-m900-45", "BlueView M900-45", 25, {{"900 kHz", 900, 45, 20, 0.5, 100, {256, 0.013, 2, 10, false}}}},
      {"blueview-m900-90", "BlueView M900-90", 25, {{"900 kHz", 900, 90, 20, 0.5, 100, {512, 0.013, 2, 10, false}}}},
      {"blueview-m900-130", "BlueView M900-130", 25, {{"900 kHz", 900, 130, 20, 0.5, 100, {768, 0.013, 2, 10, false}}}},
      {"blueview-m900-2250-130",
       "M900-2250-130",
       25,
       {{"900 kHz", 900, 130, 20, 0.5, 100, {768, 0.013, 2, 10, false}},
        {"2250 kHz", 2250, 45, 20, 0.5, 10, {256, 0.006, 0.5, 5, false}}}},
      {"blueview-mb1350-45", "BlueView MB1350-45", 40, {{"1350 kHz", 1350, 45, 1, 1, 30, {256, 0.013, 1, 10, false}}}},
      {"blueview-mb1350-90", "BlueView MB1350-90", 40, {{"1350 kHz", 1350, 90, 1, 1, 30, {512, 0.013, 1, 10, false}}}},
      {"blueview-mb2250-45", "BlueView MB2250-45", 40, {{"2250 kHz", 2250, 45, 1, 0.5, 10, {256, 0.010, 0.5, 5, false}}}},
      {"blueview-mb2250-90", "BlueView MB2250-90", 40, {{"2250 kHz", 2250, 90, 1, 0.5, 10, {512, 0.010, 0.5, 5, false}}}},
  };
  return all;
}

FrequencyMode mode_of(const Head& head) {
  FrequencyMode mode;
  mode.name = head.name;
  mode.centre_hz = static_cast<float>(1e3 * head.khz);
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(head.aperture_deg));
  mode.min_range_m = static_cast<float>(head.min_m);
  mode.max_range_m = static_cast<float>(head.max_m);
  mode.source_level_db = 210;                         // unknown: inferred
  mode.beam_spacing = BeamSpacing::uniform_in_angle;  // DS: 0.18 deg apart
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(1));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(head.vertical_deg));
  mode.receiver.full_scale_upa = 1e11f;  // unknown: fitted
  return mode;
}

struct Catalogue {
  std::vector<std::shared_ptr<const SonarModel>> models;
  std::vector<std::vector<HeadPreset>> presets;
};
/// Makes models and presets from one table, so that a head has the same index in both.
const Catalogue& catalogue() {
  static const Catalogue only = [] {
    Catalogue c;
    for (const Product& product : products()) {
      auto model = std::make_shared<SonarModel>();
      model->profile = product.profile;
      model->name = product.name;
      model->max_rate_hz = static_cast<float>(product.max_rate_hz);
      c.presets.emplace_back();
      for (const Head& head : product.heads) {
        model->modes.push_back(mode_of(head));
        c.presets.back().push_back(head.preset);
      }
      c.models.push_back(std::move(model));
    }
    return c;
  }();
  return only;
}

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() { return catalogue().models; }

std::span<const HeadPreset> head_presets(std::string_view profile) {
  const Catalogue& c = catalogue();
  const auto it = std::find_if(c.models.begin(), c.models.end(), [&](const auto& m) { return m->profile == profile; });
  if (it == c.models.end()) return {};
  return c.presets[static_cast<std::size_t>(it - c.models.begin())];
}

}  // namespace sonar::blueview
