// Command lines of sonard and sonarctl: what a value may be, and what is wrong with a line in one sentence that names the option,
// the value and what is allowed. Stands beside CLI11, which does the parsing and whose own texts it replaces.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
class Validator;
}  // namespace CLI

namespace sonar::text {

/// Checks for options. Numbers are decimal, as in a configuration: CLI11 itself would take 010 for 8.
CLI::Validator one_of(std::vector<std::string> names);
CLI::Validator whole_number(std::uint64_t low = 0, std::uint64_t high = std::numeric_limits<std::uint64_t>::max());
CLI::Validator number(double low = std::numeric_limits<double>::lowest(), double high = std::numeric_limits<double>::max());
/// To be given to transform(): ENU becomes enu.
CLI::Validator in_small_letters();

/// `unknown command "veiw"; did you mean "view"?` or the same for an option, or empty when every word in front of the first
/// value is known. Values are not looked at: the parser does that.
std::string complaint_about_words(const CLI::App& app, const std::vector<std::string>& words);

/// What the parser objected to, in our words; of a value from the environment the variable is named. `words` as typed, without
/// the program.
std::string complaint_about(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words);

/// " (sonarctl pose circle --help)": of the command that was asked for, as far as the line was understood.
std::string where_help_is(const CLI::App& app);

}  // namespace sonar::text
