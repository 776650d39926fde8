#include "clients/scene_tools/resource_paths.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "core/base/letters.hpp"

namespace sonar::scene_tools {

int version_number(std::string_view text) {
  const bool digits =
      !text.empty() && text.size() < 9 && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  return digits ? std::atoi(std::string(text).c_str()) : -1;
}

std::optional<FuelAddress> fuel_address(std::string_view address) {
  std::vector<std::string> parts;
  for (const std::filesystem::path& part : std::filesystem::path(address).lexically_normal()) parts.push_back(part.string());
  std::erase_if(parts, [](const std::string& part) { return part.empty() || part == "/"; });
  const auto is_api = [](const std::string& part) { return part.find_first_not_of("0123456789.") == std::string::npos; };
  if (parts.size() > 1 && is_api(parts[1])) parts.erase(parts.begin() + 1);
  if (parts.size() > 3 && parts[2] == "fuel" && parts[3] == "models") parts.erase(parts.begin() + 2);  // the form of web pages
  if (parts.size() < 4 || !same_letters(parts[2], "models")) return std::nullopt;
  FuelAddress out{parts[0], parts[1], parts[3], "", {}};
  std::size_t next = 4;
  if (parts.size() > next && (version_number(parts[next]) >= 0 || parts[next] == "tip")) out.version = parts[next++];
  if (parts.size() > next && parts[next] == "files") ++next;
  out.inside.assign(parts.begin() + static_cast<std::ptrdiff_t>(next), parts.end());
  return out;
}

std::string folded_name(std::string_view name) {
  std::string folded = small_letters(name);
  std::replace(folded.begin(), folded.end(), '_', ' ');
  return folded;
}

std::string model_name(std::string_view uri) {
  const auto last = [&] { return uri.substr(uri.find_last_of('/') + 1); };
  uri = uri.substr(0, uri.find("/files/"));  // a file in a model of Fuel
  while (uri.ends_with('/')) uri.remove_suffix(1);
  while (uri.find('/') != std::string_view::npos &&
         (last() == "tip" || last().find_first_not_of("0123456789") == std::string_view::npos))
    uri.remove_suffix(last().size() + 1);
  std::string name = folded_name(last());
  for (std::size_t at = 0; (at = name.find("%20")) != std::string::npos;) name.replace(at, 3, " ");
  return name;
}

std::string fetch_command(std::string_view uri) {
  constexpr std::string_view safe = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789:/._-+~% ";
  if (!uri.starts_with("https://") && !uri.starts_with("http://")) return {};
  uri = uri.substr(0, uri.find("/files/"));
  if (uri.size() > 200 || uri.find_first_not_of(safe) != std::string_view::npos) return {};
  if (!fuel_address(uri.substr(uri.find("://") + 3))) return {};
  std::string url(uri);  // the command does not accept the form of web pages
  for (const std::string_view page : {"://app.gazebosim.org/", "://app.ignitionrobotics.org/"})
    if (const std::size_t at = url.find(page), models = url.find("/fuel/models/"); at != url.npos && models != url.npos)
      url.replace(models, 13, "/models/").replace(0, at + page.size(), "https://fuel.gazebosim.org/1.0/");
  return "gz fuel download --url '" + url + "'";
}

}  // namespace sonar::scene_tools
