// Runs `sonarctl judge` and `sonarctl lab`, programs of the Python package, and `sonarctl farm`, a command of sonard. They are
// found beside sonarctl.
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>

#include "clients/sonarctl/command_line.hpp"

namespace sonar::clients {
namespace {

namespace fs = std::filesystem;

/// Returns the folder of the package: share/sonard/python if installed, or clients/python of the source tree around the build
/// folder.
fs::path package_near(const fs::path& program) {
  for (fs::path folder = program.parent_path(); folder.has_relative_path(); folder = folder.parent_path())
    for (const char* place : {"share/sonard/python", "clients/python"})
      if (std::error_code ec; fs::exists(folder / place / "sonard_client/lab.py", ec)) return folder / place;
  return {};
}

/// Returns the path of sonard, installed beside sonarctl or in the same build folder.
fs::path sonard_near(const fs::path& program) {
  const fs::path folder = program.parent_path();
  for (const fs::path& place : {folder / "sonard", folder.parent_path() / "daemon/sonard"})
    if (std::error_code ec; fs::is_regular_file(place, ec)) return place;
  return {};
}

/// Returns only if the program cannot be executed.
void execute(std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execvp(arguments[0], arguments.data());
}

Result<void> become(const std::string& module, const std::vector<std::string>& words) {
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  const fs::path package = package_near(program);
  if (package.empty())
    return failure(ErrorKind::missing_file, "the Python package sonard_client is not installed beside " + program.string() +
                                                "; with its folder in PYTHONPATH: python3 -m " + module);
  const char* path = std::getenv("PYTHONPATH");
  ::setenv("PYTHONPATH", (package.string() + (path && *path ? ":" + std::string(path) : "")).c_str(), 1);
  if (const fs::path sonard = sonard_near(program); !sonard.empty()) ::setenv("SONARD", sonard.c_str(), 0);
  std::vector<std::string> all{"python3", "-m", module};
  all.insert(all.end(), words.begin(), words.end());
  execute(all);
  return failure(ErrorKind::missing_file, "python3 is not installed");
}

Run add(CLI::App& app, const char* name, const char* purpose, const std::string& module, const std::vector<std::string>& words) {
  app.add_subcommand(name, purpose);
  return [module, words] { return become(module, {words.begin() + 1, words.end()}); };
}

}  // namespace

/// sonard makes data sets, so the farm is a command of sonard.
Run add_farm(CLI::App& app, const std::vector<std::string>& words) {
  app.add_subcommand("farm", "make labelled data sets on many machines: submit jobs, show their state, collect the results");
  return [words]() -> Result<void> {
    std::error_code ec;
    const fs::path program = fs::read_symlink("/proc/self/exe", ec), sonard = sonard_near(program);
    std::vector<std::string> all{sonard.string()};
    all.insert(all.end(), words.begin(), words.end());
    if (!sonard.empty()) execute(all);
    return failure(ErrorKind::missing_file, "sonard is not installed beside " + program.string() + "; install it there");
  };
}

Run add_judge(CLI::App& app, const std::vector<std::string>& words) {
  return add(app, "judge", "run a driver against sonard with one fault at a time, and report", "sonard_client.judge", words);
}
Run add_lab(CLI::App& app, const std::vector<std::string>& words) {
  return add(app, "lab", "run a driver and sonard in two network namespaces, with faults between them", "sonard_client.lab",
             words);
}

}  // namespace sonar::clients
