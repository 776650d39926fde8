// One sonar over one scene. Tests call the engine through it and measure the result.
#pragma once

#include <memory>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "tests/core/pipeline/reference.hpp"

namespace sonar::test {

// Modes with the published values of real devices. `silent` moves a mode to 1 kHz: then the tests' fresh water has practically
// no absorption. All other values follow from the widths.
FrequencyMode p900();         // 900 kHz, 90 deg, 1 x 20 deg, uniform in angle
FrequencyMode oculus_low();   // 1.2 MHz, 130 deg, 0.6 x 20 deg, uniform in sine
FrequencyMode oculus_high();  // 2.1 MHz, 60 deg, 0.4 x 12 deg, uniform in sine
FrequencyMode silent(FrequencyMode mode);
FrequencyMode without_elevation_pattern(FrequencyMode mode);

/// Rows at F_s = 2 b (spacing dr / 2.355), one sample per row, 16 bits.
PingSettings native_rows(double range_m, double pulse_width_m);
/// Rows of the default rule: the pulse width is 0.9 of the row spacing.
PingSettings default_rows(double range_m, int rows);

struct SoundingOptions {
  int threads = 2;
  EngineOptions engine;
};

class Sounding {
 public:
  Sounding(std::shared_ptr<const Scene> scene, const FrequencyMode& mode, const PingSettings& settings,
           const SoundingOptions& options = {});

  /// Request of the next ping. keep_pressure is on, noise and specular are off, the water has c = 1500 m/s.
  PingRequest request;

  const Ping& ping();  // computes the present request
  const Ping& ping_from(Vec3d position, RollPitchYaw attitude = {});
  const Ping& last() const { return ping_; }
  PingEngine& engine() { return *engine_; }

  const FrequencyMode& mode() const { return request.model->modes[0]; }
  reference::Medium medium() const;
  double envelope_hz() const;
  double range_of_row(double row) const;  // device range of a (fractional) row
  double row_of_range(double range_m) const;
  int rows() const { return request.settings.range_bin_count; }
  int beams() const { return request.settings.beam_count; }
  double pressure(int row, int beam) const;  // |s| [uPa]
  double power(int row, int beam) const { return pressure(row, beam) * pressure(row, beam); }
  double beam_sine(int beam) const;
  int beam_at(double azimuth_rad) const;  // the nearest beam
  int loudest_row(int beam) const;
  int loudest_beam(int row) const;

 private:
  std::unique_ptr<Parallel> pool_;
  std::unique_ptr<PingEngine> engine_;
  Ping ping_;
};

/// Peak of a Gaussian through three equidistant samples of |s|: position (offset from the middle one) and height.
struct Peak {
  double offset = 0, height = 0;
};
Peak log_parabola(double before, double middle, double after);
/// Returns the Pearson correlation.
double correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace sonar::test
