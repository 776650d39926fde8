#include "protocol/host.hpp"

namespace sonar::protocol {

// A setting that a make does not have is an error. If it were ignored, a user would assume that the ping was made with it.
Result<void> accept_settings(const Wanted& wanted, std::string_view title, std::initializer_list<std::string_view> known) {
  const SettingsOverride& s = wanted.settings;
  std::vector<std::string_view> given;
  for (const auto& [name, is_given] : {std::pair<std::string_view, bool>{"range", s.range_m.has_value()},
                                       {"rate", s.rate_hz.has_value()},
                                       {"gain", s.gain_percent.has_value()},
                                       {"mode", s.mode.has_value()},
                                       {"beams", s.beams.has_value()},
                                       {"bits", s.sample_bits.has_value()},
                                       {"gains", s.row_gains.has_value()}})
    if (is_given) given.push_back(name);
  for (const auto& [name, value] : wanted.more) given.push_back(name);
  for (const std::string_view name : given) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    if (known.size() == 0)
      return failure(ErrorKind::usage, std::string("--").append(name).append(" does not apply to ").append(title) +
                                           ", whose drivers set nothing: use `sonarctl set sonar`");
    std::string all;
    for (const std::string_view other : known) all.append(all.empty() ? "--" : ", --").append(other);
    return failure(ErrorKind::usage,
                   std::string("--").append(name).append(" does not apply to ").append(title) + ", which has " + all);
  }
  return {};
}

}  // namespace sonar::protocol
