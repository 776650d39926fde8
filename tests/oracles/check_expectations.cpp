#include <cmath>
#include <stdexcept>

#include "core/paper/paper_engine.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/render/coverage.hpp"
#include "daemon/commands/render/render_job.hpp"
#include "daemon/server/engine/start_engine.hpp"
#include "tests/oracles/expectation.hpp"

namespace sonar::render {
namespace {

/// Returns the values that formulas may use, including those of the sweep, without the `first_` ones. tests/oracles/README.md
/// lists them.
Values known_values(const RenderJob& job, const PingRequest& request) {
  const FrequencyMode& mode = job.mode();
  const PingSettings& s = job.settings;
  const double depth_m = depth_from_z(request.sonar_in_world.position_m.z);
  const double c = true_sound_speed_mps(job.config.water, depth_m), c_dev = static_cast<double>(s.device_sound_speed_mps);
  const ResolutionCell cell = cell_of(job);
  Values v = job.values;
  v["SL"] = static_cast<double>(mode.source_level_db);
  v["f"] = static_cast<double>(mode.centre_hz);
  v["c"] = c;
  v["c_dev"] = c_dev;
  v["lambda"] = c / static_cast<double>(mode.centre_hz);
  v["alpha"] = absorption_db_per_m(job.config.water, depth_m, static_cast<double>(mode.centre_hz));
  v["pulse"] = cell.pulse_width_m;
  v["row"] = s.range_bin_m;
  v["tau_eff"] = cell.energy_s;
  if (cell.beam_u > 0) v["theta_eff"] = cell.beam_u;
  return v;
}

struct Step {
  Values values;
  std::vector<Expectation> expectations;
  std::vector<double> measured;  // one value for each expectation
};

/// Returns the slope of the least-squares line over log10 of the swept value.
double slope_per_decade(const std::vector<Step>& steps, const std::string& against, std::size_t expectation) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const Step& step : steps) {
    const double x = std::log10(step.values.at(against)), y = step.measured[expectation];
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

bool is_met(const Expectation& e, double measured, double expected) {
  if (e.bound == Expectation::Bound::at_least) return measured >= expected;
  if (e.bound == Expectation::Bound::at_most) return measured <= expected;
  return std::abs(measured - expected) <= e.within;
}

tl::unexpected<Error> at_place(const Expectation& e, const Error& error) {
  return failure(error.kind, e.place + ": " + error.text);
}

/// Computes one ping of the job and measures all quantities in it.
Result<Step> take_step(const RenderInput& input, const RenderJob& job, Parallel& pool) {
  auto expectations = read_expectations(input.text, input.source, job.values);
  if (!expectations) return tl::make_unexpected(expectations.error());
  const auto make = [&](std::shared_ptr<const Scene> s) {
    return make_engine(std::move(s), pool, {.simd = job.config.engine.simd});
  };
  const auto engine = start_engine(make, job.scene);
  if (!engine) return tl::make_unexpected(engine.error());
  const std::vector<Time> times = pose_times(job);
  PingRequest request = make_request(job, world_of(job), PingNumber{1}, times.empty() ? Time{} : times.front());
  request.switches.keep_pressure = true;
  Step step{known_values(job, request), *std::move(expectations), {}};
  try {
    const std::vector<Ping> pings = (*engine)->run({&request, 1});
    for (const Expectation& e : step.expectations) {
      const auto value = measure(e, job, pings.at(0));
      if (!value) return at_place(e, value.error());
      step.measured.push_back(*value);
    }
  } catch (const std::invalid_argument& refused) {
    return failure(ErrorKind::config, input.source + ": " + refused.what());
  }
  return step;
}

}  // namespace

std::string Verdict::sentence() const {
  const char* sign = expectation.bound == Expectation::Bound::near       ? ""
                     : expectation.bound == Expectation::Bound::at_least ? "at least "
                                                                         : "at most ";
  std::string text = expectation.place + ": " + expectation.what + ": " + name_of(expectation.measure) +
                     text::format(" %.6g %s, expected %s%.6g", measured, unit_of(expectation).c_str(), sign, expected);
  if (expectation.bound == Expectation::Bound::near) text += text::format(" within %g", expectation.within);
  return text;
}

Result<std::vector<Verdict>> check_expectations(const RenderInput& input, int threads) {
  Parallel pool(threads);
  std::vector<Step> steps;
  for (const RenderJob& job : input.jobs) {
    auto step = take_step(input, job, pool);
    if (!step) return tl::make_unexpected(step.error());
    steps.push_back(*std::move(step));
  }
  std::vector<Verdict> verdicts;
  for (std::size_t i = 0; i < steps.front().expectations.size(); ++i) {
    const Expectation& e = steps.front().expectations[i];
    if (e.over != Over::each && steps.size() < 2)
      return failure(ErrorKind::config, e.place + ": a slope or difference needs a sweep of two steps or more");
    if (e.over == Over::slope && !input.jobs.front().values.contains(e.against))
      return failure(ErrorKind::config, e.place + ": against: " + e.against + " is not a swept value");
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const bool last = k + 1 == steps.size();
      if (e.over != Over::each && !last) continue;
      Values known = steps[k].values;
      for (const auto& [name, value] : steps.front().values) known["first_" + name] = value;
      const auto expected = evaluate(steps[k].expectations[i].value, known);
      if (!expected) return at_place(e, expected.error());
      Verdict v{steps[k].expectations[i], 0, *expected, false};
      v.measured = e.over == Over::each    ? steps[k].measured[i]
                   : e.over == Over::slope ? slope_per_decade(steps, e.against, i)
                                           : steps.back().measured[i] - steps.front().measured[i];
      v.met = is_met(e, v.measured, v.expected);
      verdicts.push_back(std::move(v));
    }
  }
  return verdicts;
}

}  // namespace sonar::render
