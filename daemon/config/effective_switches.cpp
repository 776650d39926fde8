#include "daemon/config/effective_switches.hpp"

namespace sonar {

std::string why_without_effect(const Switches& switches, const NamedSwitch& part) {
  if (switches.mode != Mode::canonical)
    return std::string("mode ") + (switches.mode == Mode::paper ? "paper" : "raster") + " leaves out " + part.name;
  if (switches.fixed_fan > 0 && part.is_on == &Switches::multipath) return "a fixed fan leaves out multipath";
  return {};
}

Switches effective_switches(Switches switches) {
  for (const NamedSwitch& part : named_switches)
    if (!why_without_effect(switches, part).empty()) switches.*part.is_on = false;
  return switches;
}

std::string note_of_parts_left_out(const Switches& switches) {
  std::string note;
  for (const NamedSwitch& part : named_switches)
    if (const std::string why = why_without_effect(switches, part); switches.*part.is_on && !why.empty())
      note += note.empty() ? why : std::string(", ") + part.name;
  return note.empty() ? note : note + " (docs/acoustics.md, section 8)";
}

}  // namespace sonar
