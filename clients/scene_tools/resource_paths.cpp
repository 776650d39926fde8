#include "clients/scene_tools/resource_paths.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <utility>

namespace sonar::scene_tools {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}
bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

int version_of(const fs::path& folder) { return version_number(folder.filename().string()); }

constexpr int most_looked_at = 20'000;  // entries of a folder

/// Gazebo names the folders of a downloaded model by its versions. Returns them, the newest first.
std::vector<fs::path> versions_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  int seen = 0;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (++seen > most_looked_at)
      break;
    else if (version_of(entry.path()) >= 0)
      found.push_back(entry.path());
  std::sort(found.begin(), found.end(), [](const fs::path& a, const fs::path& b) { return version_of(a) > version_of(b); });
  return found;
}

/// Looks for the exact name, then compares folded names.
fs::path child_of(const fs::path& folder, const std::string& name) {
  std::error_code error;
  if (name.empty() || name == "." || name == "..") return {};
  if (fs::exists(folder / name, error)) return folder / name;
  const std::string wanted = folded_name(name);
  int seen = 0;
  fs::path first;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (++seen > most_looked_at) break;
    if (folded_name(entry.path().filename().string()) == wanted && (first.empty() || entry.path() < first)) first = entry.path();
  }
  return first;
}
fs::path descendant_of(fs::path folder, const fs::path& wanted) {
  for (const fs::path& part : wanted)
    if (!folder.empty()) folder = child_of(folder, part.string());
  return folder;
}

/// Parses a version, so that "1.10" is later than "1.9".
std::pair<int, int> sdf_version(std::string_view text) {
  const std::size_t dot = std::min(text.find('.'), text.size());
  return {version_number(text.substr(0, dot)), dot < text.size() ? version_number(text.substr(dot + 1)) : 0};
}

/// Returns the SDF in the folder of a model: the newest one that model.config names.
fs::path model_in(const fs::path& folder) {
  const fs::path config = folder / "model.config";
  if (!is_file(config)) return is_file(folder / "model.sdf") ? folder / "model.sdf" : fs::path();
  const auto text = read_text(config);
  const auto file = text ? parse_xml(*text, config, "model.config") : tl::make_unexpected(text.error());
  fs::path best = is_file(folder / "model.sdf") ? folder / "model.sdf" : fs::path();
  if (!file) return best;
  std::pair newest{-1, -1};
  for (const Element& sdf : (*file)->root().children("sdf")) {
    const std::pair version = sdf_version(sdf.attribute("version"));
    const fs::path named = folder / fs::path(std::string(sdf.text()));
    if (version > newest && is_file(named)) best = named, newest = version;
  }
  return best;
}

/// True if a folder is the ROS package of that name. In repositories the folder often has another name.
bool is_package(const fs::path& folder, std::string_view name) {
  const fs::path manifest = folder / "package.xml";
  if (name.empty() || !is_file(manifest)) return false;
  const auto text = read_text(manifest);
  const auto file = text ? parse_xml(*text, manifest, "package.xml") : tl::make_unexpected(text.error());
  return file && (*file)->root().child("name").text() == name;
}

/// Returns the file itself, the model in a folder, or the newest version in the folder; only version `named` unless it is -1.
fs::path file_at(const fs::path& place, int named = -1) {
  if (!is_folder(place)) return is_file(place) ? place : fs::path();
  if (fs::path model = model_in(place); !model.empty()) return model;
  for (const fs::path& version : versions_in(place))
    if (named < 0 || version_of(version) == named)
      if (fs::path model = model_in(version); !model.empty()) return model;
  return {};
}

/// Decodes "%20" and similar escapes of addresses.
std::string without_escapes(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto hex = [](char c) {
      return c >= '0' && c <= '9' ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
    };
    if (text[i] == '%' && i + 2 < text.size() && hex(text[i + 1]) > 0 && hex(text[i + 2]) >= 0) {
      out += static_cast<char>(16 * hex(text[i + 1]) + hex(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

/// Searches the folders, then beside and above the referencing file: models lie next to each other, packages contain their files.
/// Last, it searches the referring model's folder, whatever its name, for that model's files. It never returns the referencing
/// file: a model may include a Fuel model of the same name.
fs::path look_around(const fs::path& wanted, const fs::path& from_file, const std::vector<fs::path>& folders, int version = -1) {
  std::error_code error;
  const fs::path from = fs::absolute(from_file, error).lexically_normal(), here = from.parent_path();
  const auto another = [&](const fs::path& place) {
    const fs::path found = file_at(place, version);
    return !found.empty() && fs::absolute(found, error).lexically_normal() == from ? fs::path() : found;
  };
  for (const fs::path& folder : folders)
    if (const fs::path found = another(folder / wanted); !found.empty()) return found;
  const std::string first = wanted.empty() ? std::string() : wanted.begin()->string();
  std::vector<fs::path> places = folders;
  fs::path above = here;
  for (int up = 0; up < 8 && !above.empty(); ++up, above = above.parent_path()) {
    for (const fs::path& place : {above, above / "models"}) {
      if (const fs::path found = another(place / wanted); !found.empty()) return found;
      places.push_back(place);
    }
    if (!first.empty() && (above.filename() == first || is_package(above, first)))
      if (const fs::path found = another(above / wanted.lexically_relative(first)); !found.empty()) return found;
    if (above == above.parent_path()) break;
  }
  for (const fs::path& place : places)
    if (const fs::path found = another(descendant_of(place, wanted)); !found.empty()) return found;
  if (wanted == fs::path(first)) return {};  // a whole model, never the referring one
  above = here;
  for (int up = 0; up < 4 && above != above.parent_path(); ++up, above = above.parent_path())
    if (!model_in(above).empty())
      if (const fs::path found = another(above / wanted.lexically_relative(first)); !found.empty()) return found;
  return {};
}

/// Finds a file of a ROS package whose folder, in one of `folders`, has another name than the package.
fs::path find_in_packages(const fs::path& wanted, const std::vector<fs::path>& folders) {
  const std::string package = wanted.empty() ? std::string() : wanted.begin()->string();
  for (const fs::path& folder : folders) {
    std::error_code error;
    int seen = 0;
    for (const auto& entry : fs::directory_iterator(folder, error))
      if (++seen > most_looked_at)
        break;
      else if (is_package(entry.path(), package))
        if (fs::path found = file_at(entry.path() / wanted.lexically_relative(package)); !found.empty()) return found;
  }
  return {};
}

/// Returns the folders in an environment variable, which colons separate.
std::vector<fs::path> folders_of(const char* variable) {
  std::vector<fs::path> folders;
  const char* value = std::getenv(variable);
  std::string_view rest = value ? value : "";
  while (!rest.empty()) {
    const std::string_view one = rest.substr(0, rest.find(':'));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    if (!one.empty()) folders.emplace_back(one);
  }
  return folders;
}

/// Returns the folders in which both generations of Gazebo keep downloads.
std::vector<fs::path> fuel_caches() {
  std::vector<fs::path> caches;
  for (const char* variable : {"GZ_FUEL_CACHE_PATH", "IGN_FUEL_CACHE_PATH"})
    if (const char* value = std::getenv(variable); value && *value) caches.emplace_back(value);
  if (const char* home = std::getenv("HOME"); home && *home)
    for (const char* folder : {".gz/fuel", ".ignition/fuel"}) caches.push_back(fs::path(home) / folder);
  return caches;
}

fs::path find_in_fuel_caches(const FuelAddress& address) {
  static constexpr std::array<std::string_view, 4> of_one_server{"fuel.gazebosim.org", "fuel.ignitionrobotics.org",
                                                                 "app.gazebosim.org", "app.ignitionrobotics.org"};
  std::vector<std::string> hosts{address.host};
  if (std::find(of_one_server.begin(), of_one_server.end(), address.host) != of_one_server.end())
    hosts.insert(hosts.end(), {std::string(of_one_server[0]), std::string(of_one_server[1])});
  for (const fs::path& cache : fuel_caches())
    for (const std::string& host : hosts) {
      const fs::path model = descendant_of(cache, fs::path(host) / address.owner / "models" / address.name);
      if (model.empty()) continue;
      std::vector<fs::path> places = versions_in(model);
      const int named = version_number(address.version);
      if (named < 0) places.push_back(model);
      for (fs::path place : places) {
        if (named >= 0 && version_of(place) != named) continue;
        for (const std::string& part : address.inside)
          if (!place.empty()) place = child_of(place, part);
        if (fs::path found = place.empty() ? place : file_at(place); !found.empty()) return found;
      }
    }
  return {};
}

}  // namespace

std::vector<fs::path> resource_folders(const std::vector<fs::path>& given) {
  std::vector<fs::path> folders = given;
  for (const char* variable : {"GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH", "IGN_GAZEBO_RESOURCE_PATH", "ROS_PACKAGE_PATH"})
    for (fs::path& folder : folders_of(variable)) folders.push_back(std::move(folder));
  for (const fs::path& prefix : folders_of("AMENT_PREFIX_PATH")) folders.push_back(prefix / "share");  // installed ROS 2 packages
  if (const char* home = std::getenv("HOME"); home && *home) folders.push_back(fs::path(home) / ".gazebo/models");
  return folders;
}

fs::path find_resource(std::string_view uri, const fs::path& from_file, const std::vector<fs::path>& folders) {
  const std::size_t colon = uri.find("://");
  const std::string_view scheme = colon == std::string_view::npos ? std::string_view() : uri.substr(0, colon);
  if (uri.empty() || uri.size() > 4000 || uri.find('\0') != std::string_view::npos) return {};
  std::string path = std::string(scheme.empty() ? uri : uri.substr(colon + 3));
  if (!scheme.empty()) path = without_escapes(path);
  if (scheme == "http" || scheme == "https" || scheme == "fuel") {  // never fetched, but a local copy may exist
    const auto address = fuel_address(path);
    if (address)
      if (fs::path found = find_in_fuel_caches(*address); !found.empty()) return found;
    fs::path wanted = address ? fs::path(address->name) : fs::path(path).filename();
    if (wanted.empty()) return {};
    const int version = address && address->inside.empty() ? version_number(address->version) : -1;
    if (address)
      for (const std::string& part : address->inside) wanted /= part;
    return look_around(wanted, from_file, folders, version);
  }
  const fs::path wanted = fs::path(path).lexically_normal();
  if (scheme == "model" || scheme == "package") {
    fs::path found = wanted.is_absolute() ? fs::path() : look_around(wanted, from_file, folders);
    return found.empty() && scheme == "package" ? find_in_packages(wanted, folders) : found;
  }
  if (wanted.is_absolute()) return file_at(wanted);
  if (const fs::path beside = file_at((from_file.parent_path() / wanted).lexically_normal()); !beside.empty()) return beside;
  return look_around(wanted, from_file, folders);
}

Result<std::string> read_text(const fs::path& path) {
  if (std::error_code unused; !fs::exists(path, unused))
    return failure(ErrorKind::missing_file, path.string() + ": no such file");
  if (!is_file(path)) return failure(ErrorKind::bad_data, path.string() + ": not a file");
  std::error_code error;
  if (fs::file_size(path, error) > max_xml_bytes)
    return failure(ErrorKind::bad_data, path.string() + ": is larger than 16 MiB; meshes belong in other files");
  const auto size = static_cast<std::size_t>(fs::file_size(path, error));
  std::ifstream in(path, std::ios::binary);
  std::string text(size, '\0');
  if (!in || (size > 0 && !in.read(text.data(), static_cast<std::streamsize>(size))))
    return failure(ErrorKind::io, path.string() + ": cannot be read: " + std::strerror(errno));
  return text;
}

Library library_on_disk(const std::vector<fs::path>& given) {
  return {[folders = resource_folders(given)](std::string_view uri, const fs::path& from) {
            return find_resource(uri, from, folders);
          },
          read_text};
}

}  // namespace sonar::scene_tools
