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

constexpr std::size_t short_list = 8;  // choices that a sentence can hold

std::string in_quotes(std::string_view word) { return "\"" + std::string(word) + "\""; }

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : between) + word;
  return all;
}

/// Any way of writing a decimal number that leaves no doubt; CLI11 reads it again.
bool is_number(std::string_view given, double& value) {
  const std::string_view digits = given.starts_with('+') ? given.substr(1) : given;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return error == std::errc() && end == digits.data() + digits.size() && std::isfinite(value) && !digits.starts_with("+-");
}

std::string full_name(const CLI::App& app) {
  if (app.get_parent() == nullptr) return app.get_name();
  return full_name(*app.get_parent()) + " " + app.get_name();
}

/// The command that was asked for, as far as the line was understood.
const CLI::App& asked_command(const CLI::App& app) {
  const std::vector<CLI::App*> asked = app.get_subcommands();
  return asked.empty() ? app : asked_command(*asked.front());
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

std::string unknown(const std::string& what, const std::string& word, const std::vector<std::string>& names, const CLI::App& of) {
  const std::vector<std::string_view> candidates(names.begin(), names.end());
  return "unknown " + what + " " + in_quotes(word) + suggestion(word, candidates, what + "s of " + full_name(of)) + " (" +
         full_name(of) + " --help)";
}

const CLI::App* find_command(const CLI::App& app, const std::string& word) {
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    if (command->check_name(word)) return command;
  return nullptr;
}

/// Of a word that begins with two dashes. The parser itself takes what begins with one.
std::string complaint_about_option(const CLI::App& app, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  for (const CLI::Option* option : app.get_options())
    if (option->check_name(name)) return {};
  return unknown("option", name, option_names(app), app);
}

const CLI::Option* find_option(const CLI::App& app, std::string_view name) {
  for (const CLI::Option* option : app.get_options())
    if (option->get_name() == name) return option;
  return nullptr;
}

/// Front of `text` up to `mark`.
std::string before(const std::string& text, std::string_view mark) { return text.substr(0, text.find(mark)); }

std::string sentence_about_missing(const CLI::App& asked, const std::string& said) {
  if (said.starts_with("A subcommand")) return "say what to do: " + joined(command_names(asked), ", ");
  const std::string name = before(said, " is required");
  const CLI::Option* option = find_option(asked, name);
  const std::string meaning = option == nullptr ? "" : option->get_description();
  return (asked.get_parent() == nullptr ? "it" : asked.get_name()) + " needs " + name + (meaning.empty() ? "" : ", " + meaning);
}

std::string sentence_about_count(const CLI::App& asked, const std::string& said) {
  const std::string name = before(said, said.find(": ") == std::string::npos ? " was given" : ": ");
  const CLI::Option* option = find_option(asked, name);
  if (option == nullptr || option->get_expected_max() == 0) return name + " is a switch and takes no value";
  if (option->get_items_expected_max() == 1)
    return name + (said.find("At Most") == std::string::npos ? " needs a value: " + option->get_description()
                                                             : " takes one value, not several");
  return format("%s needs %d values, with commas between: %s", name.c_str(), option->get_items_expected_min(),
                option->get_description().c_str());
}

std::string sentence_about_value(const CLI::App& asked, const std::string& said) {
  const std::string switch_words = ": Should be true/false or a number", unread = "Could not convert: ";
  if (said.ends_with(switch_words)) return before(said, switch_words) + " is a switch and takes no value";
  if (!said.starts_with(unread)) return said;
  const std::string rest = said.substr(unread.size());
  const std::string name = before(rest, " = ");
  const CLI::Option* option = find_option(asked, name);
  if (option != nullptr && option->get_expected_max() == 0) return name + " is a switch and takes no value";
  return name + ": " + in_quotes(rest.size() > name.size() + 3 ? rest.substr(name.size() + 3) : "") + " is no such value";
}

std::string sentence_about_extras(const CLI::App& asked, const std::string& said) {
  const std::string words = said.substr(std::min(said.size(), said.find(": ") + 2));
  const bool several = words.find(' ') != std::string::npos;
  return in_quotes(words) +
         (words.starts_with('-') ? " is no option of "
          : several              ? " are words too many for "
                                 : " is a word too many for ") +
         full_name(asked);
}

std::string sentence(const CLI::App& asked, CLI::ExitCodes kind, const std::string& said) {
  using enum CLI::ExitCodes;
  if (kind == RequiredError) return sentence_about_missing(asked, said);
  if (kind == ArgumentMismatch) return sentence_about_count(asked, said);
  if (kind == ConversionError) return sentence_about_value(asked, said);
  if (kind == ExtrasError) return sentence_about_extras(asked, said);
  const std::string requires_word = " requires ", excludes_word = " excludes ";
  if (kind == RequiresError)
    return before(said, requires_word) + " makes sense only with " + said.substr(said.find(requires_word) + requires_word.size());
  if (kind == ExcludesError)
    return before(said, excludes_word) + " and " + said.substr(said.find(excludes_word) + excludes_word.size()) +
           " cannot be given together";
  return said;
}

/// CLI11 names the option; of a value that came from the environment the user knows the variable.
std::string with_its_source(std::string sentence, const CLI::App& asked, const std::vector<std::string>& words) {
  for (const CLI::Option* option : asked.get_options()) {
    const std::string name = option->get_name(), variable = option->get_envname();
    if (variable.empty() || !sentence.starts_with(name + ":") || std::getenv(variable.c_str()) == nullptr) continue;
    const auto is_it = [&name](const std::string& word) { return word == name || word.starts_with(name + "="); };
    if (std::none_of(words.begin(), words.end(), is_it)) sentence.replace(0, name.size(), variable + " (environment)");
  }
  return sentence;
}

}  // namespace

CLI::Validator one_of(std::vector<std::string> names) {
  const std::string described = joined(names, "|");
  const auto refusal = [names = std::move(names)](std::string& given) -> std::string {
    if (std::find(names.begin(), names.end(), given) != names.end()) return {};
    if (names.size() == 1) return in_quotes(given) + " is not " + names.front() + ", all that there is";
    if (names.size() <= short_list) return in_quotes(given) + " is none of " + joined(names, ", ");
    const std::vector<std::string_view> candidates(names.begin(), names.end());
    return "there is no " + in_quotes(given) + suggestion(given, candidates, "give one of");
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

std::string complaint_about_words(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* at = &app;
  for (const std::string& word : words) {
    if (word == "--") break;
    const bool wants_command = at->get_require_subcommand_min() > 0;
    if (!word.empty() && word.front() != '-' && wants_command) {
      const CLI::App* command = find_command(*at, word);
      if (command == nullptr) return unknown("command", word, command_names(*at), *at);
      at = command;
    } else if (word.size() > 2 && word.starts_with("--")) {
      if (std::string complaint = complaint_about_option(*at, word); !complaint.empty()) return complaint;
    }
  }
  return {};
}

std::string complaint_about(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
  const CLI::App& asked = asked_command(app);
  const auto kind = static_cast<CLI::ExitCodes>(error.get_exit_code());
  std::string text = with_its_source(sentence(asked, kind, error.what()), asked, words);
  // One line, whatever was typed.
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text + where_help_is(app);
}

std::string where_help_is(const CLI::App& app) { return " (" + full_name(asked_command(app)) + " --help)"; }

}  // namespace sonar::text
