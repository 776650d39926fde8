// Command lines of sonard and sonarctl, parsed by CLI11. This file adds checks of values, and errors that suggest the nearest
// known word.
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

/// Checks for options. Numbers are decimal, as in a configuration: CLI11 itself would read 010 as 8.
CLI::Validator one_of(std::vector<std::string> names);
CLI::Validator whole_number(std::uint64_t low = 0, std::uint64_t high = std::numeric_limits<std::uint64_t>::max());
CLI::Validator number(double low = std::numeric_limits<double>::lowest(), double high = std::numeric_limits<double>::max());
/// Converts ENU to enu. Pass it to transform().
CLI::Validator in_small_letters();

/// Like CLI::App::parse. If a value of an environment variable fails the option's check, CLI11 2.4 and later ignore the value.
/// Here it is an error with every version.
void parse(CLI::App& app, int argc, const char* const* argv);

/// The error of a command line as one line that ends with where_help_is(). For unknown commands and options: `unknown command
/// "veiw"; did you mean "view"?`. For other errors it is the parser's text. For a value from an environment variable, the error
/// names the variable. Returns an empty text for --help and --version without an unknown word. `words`: the command line as
/// typed, without the program.
std::string complaint_about(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words);

/// The help option of the innermost command that the parser has recognised: " (sonarctl pose circle --help)".
std::string where_help_is(const CLI::App& app);

}  // namespace sonar::text
