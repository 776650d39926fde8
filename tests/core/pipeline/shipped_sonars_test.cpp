// The picture of a flat bed sample by sample, in expected power: no holes for any shipped sonar.
#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "protocol/blueview/models.hpp"
#include "protocol/oculus/models.hpp"
#include "protocol/oculus/settings.hpp"
#include "tests/core/pipeline/coverage.hpp"

namespace sonar::test {
namespace {

using coverage::coverage_of;
using coverage::record_coverage;

// Each different pair of beam and pulse of the products, at its greatest range, with the rows of its vendor.
TEST(CoverageOracles, Oracle32_EveryShippedSonarFillsAFlatBed) {
  std::set<std::tuple<float, float, double, double>> seen;  // sectors and carriers have no influence here
  const auto is_new = [&](const FrequencyMode& m, double range_m, double pulse_m) {
    return seen.insert({m.pattern.azimuth_width_rad, m.pattern.elevation_width_rad, range_m, pulse_m}).second;
  };
  const auto look = [](const SonarModel& model, const FrequencyMode& mode, const PingSettings& settings) {
    const std::string what = model.name + " " + mode.name + " at " + std::to_string(static_cast<int>(settings.range_m)) + " m";
    record_coverage(what, coverage_of(mode, settings, 0.2 * settings.range_m, 0.25, 0.3), 10000);
  };
  for (const auto& model : oculus::models()) {
    for (const FrequencyMode& mode : model->modes) {
      const double range = static_cast<double>(mode.max_range_m);
      const oculus::RowGrid rows = oculus::row_grid(range, 1500);
      if (!is_new(mode, range, rows.spacing_m)) continue;
      look(*model, mode, default_rows(rows.count * rows.spacing_m, rows.count));
    }
  }
  for (const auto& model : blueview::models()) {
    const auto presets = blueview::head_presets(model->profile);
    for (std::size_t head = 0; head < model->modes.size(); ++head) {
      const blueview::HeadPreset& preset = presets[head];
      if (!is_new(model->modes[head], preset.stop_m, preset.bin_m)) continue;
      PingSettings settings = default_rows(preset.stop_m, static_cast<int>(preset.stop_m / preset.bin_m));
      settings.beam_count = preset.beams;
      settings.pulse_width_m = static_cast<float>(preset.bin_m);
      look(*model, model->modes[head], settings);
    }
  }
}

}  // namespace
}  // namespace sonar::test
