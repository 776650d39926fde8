// Expectations of a render file (its `expect:` list) and their measurement (CONTRIBUTING.md, "An oracle"). An oracle of
// acoustics is such a file. oracle_files_test.cpp runs all of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {

/// Part of the picture, in device ranges and azimuths (positive to port). The default is the whole picture.
struct Window {
  double from_m = 0, to_m = 1e9;
  double from_deg = -180, to_deg = 180;
};

enum class Measure {
  peak_level_db,     // level of the loudest sample, interpolated between the rows by a log-parabola [dB re 1 uPa]
  peak_range_m,      // device range of that peak
  peak_bearing_deg,  // azimuth of the peak, interpolated between the beams by a log-parabola, positive to port
  mean_level_db,     // 10 log10 of the mean power
  energy_db,         // power of a beam summed over time, mean over the beams [dB re 1 uPa^2 s]
  strength_db,       // sum of sigma_i / r_i^4, from the picture [dB re 1 / m^2]; only for beams uniform in the sine
  coverage_percent,  // bins within 1 dB of the closed form on a plane bed
  coverage_worst_db,
};

enum class Over {
  each,        // every step of the sweep separately
  slope,       // change per decade of a swept value, by least squares
  difference,  // last step minus first step
};

struct Expectation {
  int oracle = 0;  // number of the oracle in the table that a test run prints; 0 = none
  std::string what;
  Measure measure{};
  Over over = Over::each;
  std::string against;  // slope: the swept value
  Window window;
  std::optional<Window> less;  // if set, the value in this window is subtracted
  enum class Bound { near, at_least, at_most } bound = Bound::near;
  std::string value;  // a formula (tests/oracles/README.md lists its names)
  double within = 0;  // near: the tolerance
  std::string place;  // file:line:col
};

/// Reads the expectations of one step of the sweep. `text` is the render file; errors name the position in it.
Result<std::vector<Expectation>> read_expectations(const std::string& text, const std::string& source, const Values& values);

std::string name_of(Measure measure);
std::string unit_of(const Expectation& expectation);

/// Measures the quantity in the ping of this job.
Result<double> measure(const Expectation& expectation, const RenderJob& job, const Ping& ping);

struct Verdict {
  Expectation expectation;
  double measured = 0, expected = 0;
  bool met = false;
  std::string sentence() const;  // position in the file, quantity, measured and expected value
};
/// Renders one ping of every job of a file that parse_render_file() has read, and checks the expectations. Errors: no
/// expectations, wrong keys, an engine that cannot start, an invalid formula.
Result<std::vector<Verdict>> check_expectations(const RenderInput& input, int threads);

}  // namespace sonar::render
