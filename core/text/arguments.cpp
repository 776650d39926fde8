#include "core/text/arguments.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"

namespace sonar::text {
namespace {

constexpr std::size_t short_list = 8;  // number of choices that an error lists

std::string in_quotes(std::string_view word) { return "\"" + std::string(word) + "\""; }

/// True if a word is a decimal number in any unambiguous form. CLI11 converts it afterwards.
bool is_number(std::string_view given, double& value) {
  const std::string_view digits = given.starts_with('+') ? given.substr(1) : given;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return error == std::errc() && end == digits.data() + digits.size() && std::isfinite(value) && !digits.starts_with("+-");
}

std::string full_name(const CLI::App& app) {
  if (app.get_parent() == nullptr) return app.get_name();
  return full_name(*app.get_parent()) + " " + app.get_name();
}

/// The innermost command that the parser has recognised.
const CLI::App& requested_command(const CLI::App& app) {
  const std::vector<CLI::App*> requested = app.get_subcommands();
  return requested.empty() ? app : requested_command(*requested.front());
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    if (!command->get_name().empty()) names.push_back(command->get_name());
  return names;
}
std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

/// The first command with words that the parser did not recognise, and the first of these words.
struct UnknownWord {
  const CLI::App* command = nullptr;
  std::string word;
};
UnknownWord unknown_word(const CLI::App& app) {
  for (const std::string& word : app.remaining())
    if (word != "--") return {&app, word};
  for (const CLI::App* command : app.get_subcommands())
    if (UnknownWord found = unknown_word(*command); found.command != nullptr) return found;
  return {};
}

std::string error_of_unknown(const UnknownWord& unknown) {
  const CLI::App& command = *unknown.command;
  const auto suggested = [&](const char* what, const std::string& word, const std::vector<std::string>& names) {
    const std::vector<std::string_view> candidates(names.begin(), names.end());
    return std::string("unknown ") + what + " " + in_quotes(word) +
           suggestion(word, candidates, what + ("s of " + full_name(command)));
  };
  if (unknown.word.size() > 1 && unknown.word.starts_with('-'))
    return suggested("option", unknown.word.substr(0, unknown.word.find('=')), option_names(command));
  if (command.get_require_subcommand_min() > 0) return suggested("command", unknown.word, command_names(command));
  return "unexpected argument " + in_quotes(unknown.word);
}

/// The error text of CLI11. If a command or argument is missing, that text contains neither choices nor meaning, so another
/// text is returned.
std::string error_of_parser(const CLI::App& requested, const CLI::ParseError& error) {
  if (error.get_exit_code() != static_cast<int>(CLI::ExitCodes::RequiredError)) return error.what();
  if (requested.get_require_subcommand_min() > 0) return "a command is required: " + joined(command_names(requested));
  for (const CLI::Option* option : requested.get_options())
    if (option->get_required() && option->count() == 0) return option->get_name() + " is required: " + option->get_description();
  return error.what();
}

/// CLI11 names the option in its error, except for hidden options. If the value came from an environment variable, the error
/// must name the variable. CLI11 reads the variables of all commands, not only of the requested one.
std::string with_its_source(const std::string& sentence, const CLI::App& app, const std::vector<std::string>& words) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string variable = option->get_envname(), name = option->get_name();
    if (variable.empty() || !sentence.starts_with(name + ":") || std::getenv(variable.c_str()) == nullptr) continue;
    const auto is_it = [&name](const std::string& word) { return word == name || word.starts_with(name + "="); };
    if (std::none_of(words.begin(), words.end(), is_it)) return variable + " (environment)" + sentence.substr(name.size());
  }
  for (const CLI::App* command : app.get_subcommands({}))
    if (std::string named = with_its_source(sentence, *command, words); named != sentence) return named;
  return sentence;
}

void check_environment(CLI::App& app) {
  for (CLI::Option* option : app.get_options({})) {
    const char* value = option->get_envname().empty() ? nullptr : std::getenv(option->get_envname().c_str());
    if (value == nullptr || *value == '\0' || option->count() > 0) continue;
    option->add_result(value);
    option->run_callback();
  }
  for (CLI::App* command : app.get_subcommands({})) check_environment(*command);
}

}  // namespace

void parse(CLI::App& app, int argc, const char* const* argv) {
  app.parse(argc, argv);
  for (int i = 1; i < argc; ++i)  // usually a variable of a script that is not set
    if (*argv[i] == '\0')
      throw CLI::ValidationError("argument " + std::to_string(i), "it is empty: write a value, or leave it out");
  check_environment(app);
}

CLI::Validator one_of(std::vector<std::string> names) {
  const std::string described = joined(names, "|");
  const auto refusal = [names = std::move(names)](std::string& given) -> std::string {
    if (std::find(names.begin(), names.end(), given) != names.end()) return {};
    if (names.size() <= short_list) return in_quotes(given) + " is not one of: " + joined(names);
    const std::vector<std::string_view> candidates(names.begin(), names.end());
    return "unknown value " + in_quotes(given) + suggestion(given, candidates, "give one of");
  };
  return CLI::Validator(refusal, described, "one of");
}

CLI::Validator whole_number(std::uint64_t low, std::uint64_t high) {
  const bool bounded_above = high != std::numeric_limits<std::uint64_t>::max();
  const std::string least = std::to_string(low), range = least + " to " + std::to_string(high);
  const std::string allowed = bounded_above ? " from " + range : " of " + least + " or more";
  const auto refusal = [low, high, allowed](std::string& given) -> std::string {
    const auto value = parse_unsigned(given);
    if (value && low <= *value && *value <= high) return {};
    return in_quotes(given) + " is not a whole number" + allowed;
  };
  return CLI::Validator(refusal, bounded_above ? "[" + range + "]" : "", "whole number");
}

CLI::Validator number(double low, double high) {
  const bool bounded_below = low != std::numeric_limits<double>::lowest();
  const bool bounded_above = high != std::numeric_limits<double>::max();
  const std::string range = format("%.10g to %.10g", low, high);
  const std::string allowed = bounded_above ? " from " + range : bounded_below ? format(" of %.10g or more", low) : std::string();
  const auto refusal = [low, high, allowed](std::string& given) -> std::string {
    double value = 0;
    if (is_number(given, value) && low <= value && value <= high) return {};
    return in_quotes(given) + " is not a number" + allowed;
  };
  return CLI::Validator(refusal, bounded_above ? "[" + range + "]" : "", "number");
}

CLI::Validator in_small_letters() {
  const auto change = [](std::string& given) -> std::string {
    given = CLI::detail::to_lower(given);
    return {};
  };
  return CLI::Validator(change, "", "small letters");
}

std::string complaint_about(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
  const CLI::App& requested = requested_command(app);
  const UnknownWord unknown = unknown_word(app);
  const bool is_help = error.get_exit_code() == 0;
  if (is_help && unknown.command == nullptr) return {};
  std::string text =
      unknown.command != nullptr ? error_of_unknown(unknown) : with_its_source(error_of_parser(requested, error), app, words);
  // Replaces line breaks, so that the error is one line.
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text + where_help_is(app);
}

std::string where_help_is(const CLI::App& app) { return " (" + full_name(requested_command(app)) + " --help)"; }

}  // namespace sonar::text
