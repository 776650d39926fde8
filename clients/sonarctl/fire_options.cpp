#include "clients/sonarctl/fire_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

using text::number;
using text::one_of;
using text::whole_number;

constexpr const char* settings_group = "Settings of the sonar";

const std::map<std::string, oculus::PingRate>& rates() {
  using oculus::PingRate;
  static const std::map<std::string, PingRate> by_name{{"2", PingRate::hz2},   {"5", PingRate::hz5},
                                                       {"10", PingRate::hz10}, {"15", PingRate::hz15},
                                                       {"40", PingRate::hz40}, {"standby", PingRate::standby}};
  return by_name;
}

}  // namespace

void FireArguments::add_to(CLI::App& app) {
  command = &app;
  const auto group = [](CLI::Option* option) { return option->group(settings_group)->capture_default_str(); };
  group(app.add_option("--mode", mode, "1 low frequency, wide; 2 high frequency, narrow; a BlueView sonar's head, from 1"))
      ->check(whole_number(1, 2));
  CLI::Option* metres = group(app.add_option("--range", range_m, "metres"))->check(number(0.0, 1000.0));
  group(app.add_option("--range-percent", range_percent, "of the mode's maximum, instead of metres"))
      ->check(number(0.0, 100.0))
      ->excludes(metres);
  group(app.add_option("--gain", gain_percent, "per cent"))->check(number(0.0, 100.0));
  group(app.add_option("--rate", rate, "maximum ping rate [Hz]"))->check(one_of({"2", "5", "10", "15", "40", "standby"}));
  group(app.add_option("--beams", beams, ""))->check(one_of({"256", "512"}));
  group(app.add_option("--bits", bits, "bits per sample; 32 needs --version 2"))->check(one_of({"8", "16", "32"}));
  group(app.add_option("--gamma", gamma, "wire value: gamma = value / 255"))->check(whole_number(0, 255));
  group(app.add_option("--speed-of-sound", sound_speed_mps, "m/s; 0 = the sonar computes it"))->check(number(0.0, 2000.0));
  group(app.add_option("--salinity", salinity_ppt, "ppt"))->check(number(0.0, 50.0));
  group(app.add_option("--version", version, "version of the messages"))->check(whole_number(0, 2));
  app.add_flag("--gains", row_gains, "request a gain in front of every row")->group(settings_group);
  app.add_flag("--gain-assist", gain_assist, "flag bit 4")->group(settings_group);
  app.add_flag("--trigger", trigger, "one ping for each request (network trigger)")->group(settings_group);
}

HeadRequest FireArguments::head_request() const {
  HeadRequest request;
  if (command == nullptr) return request;
  const auto typed = [this](const char* name) { return command->count(name) > 0; };
  if (typed("--mode")) request.head = static_cast<std::size_t>(mode - 1);
  if (typed("--range")) request.range_m = range_m;
  if (typed("--gain")) request.gain_percent = gain_percent;
  if (typed("--rate") && rate != "standby") request.rate_hz = std::stod(rate);
  for (const CLI::Option* option : command->get_options()) {
    const std::string name = option->get_name();
    const bool for_heads = name == "--mode" || name == "--range" || name == "--gain" || (name == "--rate" && rate != "standby");
    if (option->get_group() == settings_group && option->count() > 0 && !for_heads) request.oculus_only.push_back(name);
  }
  return request;
}

oculus::FireRequest FireArguments::request() const {
  namespace flag = oculus::flag;
  oculus::FireRequest fire;
  fire.version = static_cast<std::uint16_t>(bits == 32 ? 2 : version);
  oculus::FireSettings& s = fire.settings;
  s.mode = static_cast<std::uint8_t>(mode);
  s.ping_rate = rates().at(rate);
  s.gamma = static_cast<std::uint8_t>(gamma);
  s.flags = flag::simple_result;
  if (range_percent <= 0) s.flags |= flag::range_in_metres;
  if (beams == 512) s.flags |= flag::beams_512;
  if (bits > 8) s.flags |= flag::samples_16_bit;
  if (row_gains) s.flags |= flag::row_gains;
  if (gain_assist) s.flags |= flag::gain_assist;
  if (trigger) s.flags |= flag::network_trigger;
  if (bits == 32) fire.extension.flags = flag::extended_32_bit;
  s.range = range_percent > 0 ? range_percent : range_m;
  s.gain_percent = gain_percent;
  s.sound_speed_mps = sound_speed_mps;
  s.salinity_ppt = salinity_ppt;
  return fire;
}

}  // namespace sonar::clients
