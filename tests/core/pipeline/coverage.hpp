// Shares of the samples of a flat bed that agree with the closed form, in expected power.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "core/base/units.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::coverage {

inline double db(double power_ratio) { return 10 * std::log10(power_ratio); }

inline std::shared_ptr<const Scene> flat_bed(double reach_m, double lambert_db) {
  return SceneMaker()
      .add(height_field(-2, 1.1 * reach_m, -reach_m, reach_m, 0.1 * reach_m, [](double, double) { return 0.0; }), lambert_db)
      .make();
}

struct Coverage {
  int samples = 0, within_1_db = 0;
  double worst_db = 0;
  double share() const { return static_cast<double>(within_1_db) / samples; }
};

/// The closed form averaged over the pulse's energy: where the fan's edge or the first return is near it changes within a pulse.
inline double expected_db(const reference::SeabedLevel& bed, double range_m, double sine, double dr) {
  double sum = 0, weights = 0;
  for (int i = -6; i <= 6; ++i) {
    const double off = i / 6.0;  // in -3 dB widths
    const double weight = std::pow(0.5, 4 * off * off);
    sum += weight * power_from_db(bed.db(range_m + off * dr, sine)), weights += weight;
  }
  return db(sum / weights);
}

/// Every sample of every beam within 40 degrees between the first and last return of a bed, 2 dr inside both ends, where the
/// two-way pattern is above -20 dB: against the closed form.
inline Coverage coverage_of(const FrequencyMode& mode, const PingSettings& settings, double height, double tilt, double yaw) {
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

inline void record_coverage(const std::string& what, const Coverage& c, int samples_at_least) {
  EXPECT_GT(c.samples, samples_at_least) << what;
  record_at_least(32, "share within 1 dB, " + what, 0.9999, c.share(),
                  "");  // one sample in 180,000 is off, at the edge of the fan
}

}  // namespace sonar::test::coverage
