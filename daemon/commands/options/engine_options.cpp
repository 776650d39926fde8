#include "daemon/commands/options/engine_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "core/base/enum_names.hpp"
#include "core/text/arguments.hpp"
#include "daemon/config/effective_switches.hpp"

namespace sonar {

using text::one_of;
using text::whole_number;

void add_model_options(CLI::App& app, EngineOptionsGiven& given) {
  constexpr const char* parts = "Parts of the model (a configuration may override these defaults)";
  app.add_option("--seed", given.seed, "seed of speckle and noise (default 1)")->check(whole_number())->envname("SONARD_SEED");
  app.add_option("--simd", given.simd, "instruction set of the hot loops (default auto)")
      ->check(one_of({simd_level_names.begin(), simd_level_names.end()}))
      ->envname("SONARD_SIMD");
  app.add_option("--mode", given.mode,
                 "acoustic model: canonical is sonard's own (default); for comparison, paper and raster are Choi 2025 as printed")
      ->check(one_of({mode_names.begin(), mode_names.end()}))
      ->group(parts);
  app.add_option("--fixed-fan", given.fixed_fan,
                 "number of rays per column, each with one scatterer, without surface cells; default 0: the rays of --mode")
      ->check(whole_number(0, most_fixed_rays))
      ->group(parts);
  app.add_flag("--expected-power", given.expected_power, "mean echo power instead of speckle")->group(parts);
  for (std::size_t i = 0; i < named_switches.size(); ++i) {
    const NamedSwitch& part = named_switches[i];
    app.add_option(option_of(part), given.switches[i],
                   std::string(part.meaning) + " (default " + (product_switches.*part.is_on ? "on)" : "off)"))
        ->check(one_of({"on", "off"}))
        ->group(parts);
  }
}

std::string option_of(const NamedSwitch& part) {
  std::string option = std::string("--") + part.name;
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

void add_device_option(CLI::App& app, EngineOptionsGiven& given) {
  app.add_option("--engine", given.device, "device that computes the pings; auto: the CUDA device if there is one (default cpu)")
      ->check(one_of({engine_device_names.begin(), engine_device_names.end()}))
      ->envname("SONARD_ENGINE");
}

void add_engine_options(CLI::App& app, EngineOptionsGiven& given) {
  app.add_option("--threads", given.threads, "compute threads (default 0: all cores)")
      ->check(whole_number(0, 256))
      ->envname("SONARD_THREADS");
  add_device_option(app, given);
  add_model_options(app, given);
}

Result<void> override_engine(EngineConfig& engine, std::uint64_t& seed, const EngineOptionsGiven& given) {
  if (given.threads) engine.threads = *given.threads;
  if (given.seed) seed = *given.seed;
  engine.device = enum_from<EngineDevice>(given.device, engine_device_names).value_or(engine.device);
  engine.simd = enum_from<SimdLevel>(given.simd, simd_level_names).value_or(engine.simd);
  // --simd auto must override SONARD_SIMD, which SimdLevel::automatic would read. So this requests the best level, and
  // kernels_for() uses the best one that the processor has.
  if (given.simd == "auto") engine.simd = SimdLevel::avx512;
  if (given.expected_power) engine.switches.expected_power = true;
  engine.switches.mode = enum_from<Mode>(given.mode, mode_names).value_or(engine.switches.mode);
  if (given.fixed_fan) engine.switches.fixed_fan = *given.fixed_fan;
  for (std::size_t i = 0; i < named_switches.size(); ++i) {
    if (given.switches[i].empty()) continue;
    const NamedSwitch& part = named_switches[i];
    engine.switches.*part.is_on = given.switches[i] == "on";
    const std::string why = why_without_effect(engine.switches, part);
    if (engine.switches.*part.is_on && !why.empty())
      return failure(ErrorKind::usage,
                     option_of(part) + " on has no effect: " + why + "; leave it out, or change --mode or --fixed-fan");
  }
  return {};
}

}  // namespace sonar
