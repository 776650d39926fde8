#include "clients/sonarctl/command_line.hpp"

#include <CLI/CLI.hpp>
#include <string_view>

#include "core/text/nearest.hpp"

namespace sonar::clients {
namespace {

std::string quoted(const std::string& word) { return "\"" + word + "\""; }

std::string full_name(const CLI::App& app) {
  if (app.get_parent() == nullptr) return "sonarctl";
  return full_name(*app.get_parent()) + " " + app.get_name();
}

std::string unknown(const std::string& what, const std::string& word, const std::vector<std::string>& names, const CLI::App& of) {
  const std::vector<std::string_view> candidates(names.begin(), names.end());
  return "unknown " + what + " " + quoted(word) + text::suggestion(word, candidates, what + "s of " + full_name(of)) + " (" +
         full_name(of) + " --help)";
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

bool starts_command(const std::string& word) { return !word.empty() && word.front() != '-'; }

std::string complaint_about_command(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({}))
    if (!command->get_name().empty()) names.push_back(command->get_name());
  return unknown("command", word, names, app);
}

const CLI::App* find_command(const CLI::App& app, const std::string& word) {
  for (const CLI::App* command : app.get_subcommands({}))
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

}  // namespace

std::string complaint_about_words(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* at = &app;
  for (const std::string& word : words) {
    if (word == "--") break;
    const bool wants_command = at->get_require_subcommand_min() > 0;
    if (starts_command(word) && wants_command) {
      const CLI::App* command = find_command(*at, word);
      if (command == nullptr) return complaint_about_command(*at, word);
      at = command;
    } else if (word.size() > 2 && word.starts_with("--")) {
      if (std::string complaint = complaint_about_option(*at, word); !complaint.empty()) return complaint;
    }
  }
  return {};
}

}  // namespace sonar::clients
