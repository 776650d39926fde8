// Oracles on the picture of a bed, sample by sample, in expected power: no holes for any shipped sonar, relief that agrees with
// brute force, and the speckle's statistics at long range, where few cells share a sample.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <vector>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "protocol/blueview/models.hpp"
#include "protocol/oculus/models.hpp"
#include "protocol/oculus/settings.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

std::shared_ptr<const Scene> flat_bed(double reach_m, double lambert_db) {
  return SceneMaker()
      .add(height_field(-2, 1.1 * reach_m, -reach_m, reach_m, 0.1 * reach_m, [](double, double) { return 0.0; }), lambert_db)
      .make();
}

struct Coverage {
  int samples = 0, within_1_db = 0;
  double worst_db = 0;
  double share() const { return static_cast<double>(within_1_db) / samples; }
};

/// The closed form, averaged over the pulse's energy. Near the fan's edge and near the first return the closed form changes
/// within a pulse.
double expected_db(const reference::SeabedLevel& bed, double range_m, double sine, double dr) {
  double sum = 0, weights = 0;
  for (int i = -6; i <= 6; ++i) {
    const double off = i / 6.0;  // in -3 dB widths
    const double weight = std::pow(0.5, 4 * off * off);
    sum += weight * power_from_db(bed.db(range_m + off * dr, sine)), weights += weight;
  }
  return db(sum / weights);
}

/// Compares with the closed form every sample of every beam within 40 degrees, between the first and the last return of a bed,
/// 2 dr inside both ends, where the two-way pattern is above -20 dB.
Coverage coverage_of(const FrequencyMode& mode, const PingSettings& settings, double height, double tilt, double yaw) {
  const double lambert_db = -27, dr = static_cast<double>(settings.pulse_width_m);
  Sounding s(flat_bed(settings.range_m * 1.15, lambert_db), mode, settings);
  s.request.switches.expected_power = true;
  s.ping_from({0, 0, height}, {0, tilt, yaw});
  const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, tilt);
  Coverage c;
  for (int j = 0; j < s.beams(); ++j) {
    const double u = s.beam_sine(j);
    if (std::abs(u) > std::sin(rad_from_deg(40))) continue;
    for (int row = 0; row < s.rows(); ++row) {
      const double r = s.range_of_row(row);
      if (!(r - 2 * dr > height / std::sqrt(1 - u * u))) continue;
      if (!(bed.pattern(r, u) > 0.1 && bed.pattern(r - 2 * dr, u) > 0.1 && bed.pattern(r + 2 * dr, u) > 0.1)) continue;
      const double off = db(s.power(row, j)) - expected_db(bed, r, u, dr);
      c.within_1_db += std::abs(off) <= 1;
      c.worst_db = std::max(c.worst_db, std::abs(off));
      ++c.samples;
    }
  }
  return c;
}

void record_coverage(const std::string& what, const Coverage& c, int samples_at_least) {
  EXPECT_GT(c.samples, samples_at_least) << what;
  record_at_least(32, "share within 1 dB, " + what, 0.9999, c.share(),
                  "");  // one sample in 180,000 is off, at the edge of the fan
}

TEST(CoverageOracles, Oracle32_FlatBedIsFilled) {
  for (const auto& [mode, settings, what] : {std::tuple{p900(), native_rows(10, 0.0254), "P900 10 m, 928 rows"},
                                             std::tuple{p900(), default_rows(10, 354), "P900 10 m, 354 rows"},
                                             std::tuple{oculus_high(), default_rows(10, 720), "M1200d HF 10 m, 720 rows"},
                                             std::tuple{oculus_high(), default_rows(10, 437), "M1200d HF 10 m, 437 rows"},
                                             std::tuple{oculus_low(), default_rows(30, 720), "M1200d LF 30 m, 720 rows"}})
    record_coverage(what, coverage_of(mode, settings, 2, 0.25, 0), 50000);
  // Looks along the diagonal of the lattice.
  record_coverage("M1200d HF 10 m, 437 rows, 45 degrees round", coverage_of(oculus_high(), default_rows(10, 437), 2, 0.25, 0.785),
                  50000);
}

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
