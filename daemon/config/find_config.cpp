#include "daemon/config/find_config.hpp"

#include <cstdlib>
#include <utility>
#include <vector>

#include "core/base/regular_file.hpp"
#include "daemon/config/load_config.hpp"

namespace sonar {
namespace {

std::vector<std::filesystem::path> search_path() {
  std::vector<std::filesystem::path> places = {"./sonard.yaml"};
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    places.push_back(std::filesystem::path(home) / ".config/sonard/sonard.yaml");
  places.push_back("/etc/sonard/sonard.yaml");
  return places;
}

}  // namespace

Result<FoundConfig> find_config(const std::string& file, bool demo) {
  const auto found = [](Result<Config> config, std::string how, std::filesystem::path path = {}) -> Result<FoundConfig> {
    if (!config) return tl::make_unexpected(config.error());
    return FoundConfig{*std::move(config), std::move(how), std::move(path)};
  };
  if (demo) return found(demo_config(), "built-in demo");
  if (!file.empty()) return found(load_config(file), file, file);
  std::string searched;
  for (const auto& path : search_path()) {
    std::error_code error;
    (void)std::filesystem::symlink_status(path, error);
    const bool is_closed = error == std::errc::permission_denied;  // `sudo -u` may keep the HOME of another user
    if (!is_closed && !is_absent(path)) return found(load_config(path), path.string(), path);
    searched += (searched.empty() ? "" : ", ") + path.string();
  }
  return found(demo_config(), "none found (looked in " + searched + ") -> demo");
}

}  // namespace sonar
