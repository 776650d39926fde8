#include "protocol/fault_report.hpp"

#include <algorithm>

#include "protocol/control/answers.hpp"

namespace sonar {

void fill(v1::FaultKind& out, const FaultKind& kind) {
  out.set_code(std::string(kind.code));
  out.set_name(std::string(kind.name));
  out.set_tier(static_cast<std::uint32_t>(kind.tier));
  out.set_stage(std::string(fault_stage_names[static_cast<std::size_t>(kind.stage)]));
  out.set_sentence(std::string(kind.sentence));
  out.set_good_driver(std::string(kind.good_driver));
  out.set_default_s(kind.default_s);
  for (const FaultParameter& p : kind.given()) {
    v1::FaultParameter& parameter = *out.add_parameters();
    parameter.set_name(std::string(p.name));
    parameter.set_value(std::string(p.value));
    parameter.set_lowest(p.lowest);
    parameter.set_highest(p.highest);
    for (std::string_view rest = p.words; !rest.empty();) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      parameter.add_words(std::string(rest.substr(0, end)));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
}

void fill(v1::Trouble& out, const Trouble& trouble) {
  out.set_name(std::string(trouble.name));
  out.set_sentence(std::string(trouble.sentence));
  for (const Trouble::Part& part : trouble.parts)
    if (!part.code.empty()) out.add_codes(std::string(part.code));
}

}  // namespace sonar
