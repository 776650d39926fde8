// Only the rod of Choi 2025's tank: the echo in the beam towards the rod for each of the three interpretations of "turned by 15
// degrees". It is compared with an integration of eq. (5) and (6) that was made outside this program, in 2.5 mm bins
// (docs/validation.md).
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/scene/files/load_scene.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

constexpr double lambert_db = -10;  // mu 0.1

/// The front of the rod is at 0.5 m if it is not turned. Its size is 4 x 7 inches.
std::shared_ptr<const Scene> rod(const std::string& rpy_deg) {
  const std::string yaml =
      "name: rod\n"
      "materials:\n"
      "  rod: {like: aluminium, lambert_db: -10}\n"
      "objects:\n"
      "  - {name: rod, type: cylinder, material: rod, radius_m: 0.0508, length_m: 0.1778,\n"
      "     pose: {xyz_m: [0.5508, 0, 0], rpy_deg: " +
      rpy_deg + "}}\n";
  auto scene = parse_scene(yaml, "rod.yaml", ".");
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}

/// The oracle's receive array has no taper. Its axis beam looks straight ahead.
FrequencyMode untapered(FrequencyMode mode) {
  mode.pattern.azimuth_taper = Taper::uniform;
  return silent(mode);  // no absorption
}

/// Returns the energy of the whole echo in the axis beam, as the sum of sigma D^2 / (mu r^4) [dB re 1 / m^2].
double total_db(const std::string& rpy_deg, const FrequencyMode& mode) {
  PingSettings settings = native_rows(1, 0.0025);
  settings.beam_count = 513;  // one of these beams is at azimuth 0
  Sounding s(rod(rpy_deg), mode, settings);
  s.request.switches.expected_power = true;
  s.ping();
  double sum = 0;
  for (int row = 0; row < s.rows(); ++row) sum += s.power(row, 256);
  // The row spacing is at most half a pulse. Therefore the sum over rows times the spacing is the integral of the pulses'
  // energy.
  const double energy_width_m = energy_width_s(s.envelope_hz()) * 1500 / 2;
  const double power = sum * settings.range_bin_m / energy_width_m;
  return 10 * std::log10(power) - static_cast<double>(mode.source_level_db) - lambert_db;
}

TEST(TankRod, TotalsAreTheIntegrationsForEveryReadingOfFifteenDegrees) {
  struct Case {
    const char* what;
    const char* rpy_deg;
    bool high;
    double expected_db;
  };
  const Case cases[] = {{"rod lying across, HF", "[90, 0, 0]", true, -24.06},
                        {"rod lying, yawed 15 deg, LF", "[90, 0, 15]", false, -22.11},
                        {"rod upright, HF", "[0, 0, 0]", true, -21.86},
                        {"rod upright, tilted 15 deg across, LF", "[15, 0, 0]", false, -18.98},
                        {"rod upright, tilted 15 deg away, LF", "[0, 15, 0]", false, -19.13}};
  for (const Case& c : cases) {
    const FrequencyMode mode = untapered(c.high ? oculus_high() : oculus_low());
    record_oracle(no_number, std::string("tank, total echo of the ") + c.what, c.expected_db, total_db(c.rpy_deg, mode), 0.15,
                  "dB re 1/m^2");
  }
}

}  // namespace
}  // namespace sonar::test
