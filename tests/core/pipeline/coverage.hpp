// Shares of the samples of a flat bed that agree with the closed form, in expected power.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

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
  double share() const { return static_cast<double>(within_1_db) / samples; }
};

/// A function of one variable, linear between its values at equal steps.
class Table {
 public:
  Table(double first, double last, double step, const std::function<double(double)>& value) : first_(first), step_(step) {
    for (int i = 0; first + (i - 1) * step <= last; ++i) values_.push_back(value(first + i * step));
  }
  double operator()(double x) const {
    const double at = (x - first_) / step_;
    const auto i = static_cast<std::size_t>(at);
    return values_.at(i) + (at - static_cast<double>(i)) * (values_.at(i + 1) - values_.at(i));
  }

 private:
  double first_, step_;
  std::vector<double> values_;
};

/// The closed form of a bed as products of tables, because the closed form itself takes longer than the engine. A sample at
/// `range` and `sine` is in the plane of the elevations at the distance `across` = range sqrt(1 - sine^2).
class TabulatedBed {
 public:
  TabulatedBed(const Sounding& s, double lambert_db, double height, double tilt, double last_m)
      : dr_(static_cast<double>(s.request.settings.pulse_width_m)),
        bed_(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, tilt),
        flat_(without_elevation_pattern(s.mode()), s.medium(), s.envelope_hz(), lambert_db, height, tilt),
        pattern_(height, last_m, dr_ / 32, [&](double across) { return bed_.pattern(across, 0); }),
        across_(
            height + dr_ / 2, last_m, dr_ / 32,
            [&](double across) { return std::pow(bed_.pattern(across, 0), 2) / std::sqrt(across * across - height * height); }),
        range_(height + dr_ / 2, last_m, dr_ / 32, [&](double range_m) {
          return power_from_db(flat_.db(range_m, 0)) * std::sqrt(range_m * range_m - height * height);
        }) {
    for (int i = -6; i <= 6; ++i) weights_.push_back(std::pow(0.5, 4 * i * i / 36.0));
  }

  double pattern(double range_m, double cosine) const { return pattern_(range_m * cosine); }
  /// Returns the power averaged over the pulse's energy: it changes within a pulse near the fan's edge and the first
  /// return.
  double power(double range_m, double cosine) const {
    double sum = 0, weights = 0;
    for (int i = -6; i <= 6; ++i) {
      const double at_m = range_m + i / 6.0 * dr_;  // in -3 dB widths
      const double weight = weights_[static_cast<std::size_t>(i + 6)];
      sum += weight * range_(at_m) * across_(at_m * cosine), weights += weight;
    }
    return sum / weights;
  }
  /// Returns the difference of the tables from the closed form at one place.
  double error_db(double range_m, double sine) const {
    return db(range_(range_m) * across_(range_m * std::sqrt(1 - sine * sine))) - bed_.db(range_m, sine);
  }

 private:
  double dr_;
  reference::SeabedLevel bed_, flat_;  // flat_: without the elevation pattern
  Table pattern_, across_, range_;
  std::vector<double> weights_;
};

/// Compares samples of a flat bed with the closed form: in the beams within 40 degrees, from 2 dr after the first return, and
/// where the two-way pattern is above -20 dB at the sample and 2 dr to both sides.
inline Coverage coverage_of(const FrequencyMode& mode, const PingSettings& settings, double height, double tilt, double yaw) {
  const double lambert_db = -27, dr = static_cast<double>(settings.pulse_width_m);
  Sounding s(flat_bed(settings.range_m * 1.15, lambert_db), mode, settings);
  s.request.switches.expected_power = true;
  s.ping_from({0, 0, height}, {0, tilt, yaw});
  const TabulatedBed bed(s, lambert_db, height, tilt, s.range_of_row(s.rows()) + 3 * dr);
  Coverage c;
  for (int j = 0; j < s.beams(); ++j) {
    const double u = s.beam_sine(j), cosine = std::sqrt(1 - u * u);
    if (std::abs(u) > std::sin(rad_from_deg(40))) continue;
    for (int row = 0; row < s.rows(); ++row) {
      const double r = s.range_of_row(row);
      if (!((r - 2 * dr) * cosine > height)) continue;
      if (!(bed.pattern(r, cosine) > 0.1 && bed.pattern(r - 2 * dr, cosine) > 0.1 && bed.pattern(r + 2 * dr, cosine) > 0.1))
        continue;
      c.within_1_db += std::abs(db(s.power(row, j) / bed.power(r, cosine))) <= 1;
      ++c.samples;
      if (c.samples % 1000 == 0) {
        EXPECT_NEAR(bed.error_db(r, u), 0, 0.01) << r << " m, sine " << u;
      }
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
