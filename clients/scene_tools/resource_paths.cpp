#include "clients/scene_tools/resource_paths.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

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

/// The SDF that a model's folder holds: the newest that model.config names.
fs::path model_in(const fs::path& folder) {
  const fs::path config = folder / "model.config";
  if (!is_file(config)) return is_file(folder / "model.sdf") ? folder / "model.sdf" : fs::path();
  const auto text = read_text(config);
  const auto file = text ? parse_xml(*text, config, "model.config") : tl::make_unexpected(text.error());
  fs::path best = is_file(folder / "model.sdf") ? folder / "model.sdf" : fs::path();
  if (!file) return best;
  double newest = -1;
  for (const Element& sdf : (*file)->root().children("sdf")) {
    const double version = std::atof(std::string(sdf.attribute("version")).c_str());
    const fs::path named = folder / fs::path(std::string(sdf.text()));
    if (version > newest && is_file(named)) best = named, newest = version;
  }
  return best;
}

/// The file itself, or the model that a folder holds.
fs::path file_at(const fs::path& place) {
  if (is_folder(place)) return model_in(place);
  return is_file(place) ? place : fs::path();
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
fs::path look_around(const fs::path& wanted, const fs::path& from_file, const std::vector<fs::path>& folders) {
  for (const fs::path& folder : folders)
    if (const fs::path found = file_at(folder / wanted); !found.empty()) return found;
  std::error_code error;
  fs::path above = fs::absolute(from_file, error).parent_path();
  const std::string first = wanted.empty() ? std::string() : wanted.begin()->string();
  for (int up = 0; up < 8 && !above.empty(); ++up, above = above.parent_path()) {
    for (const fs::path& place : {above / wanted, above / "models" / wanted})
      if (const fs::path found = file_at(place); !found.empty()) return found;
    if (!first.empty() && above.filename() == first)
      if (const fs::path found = file_at(above / wanted.lexically_relative(first)); !found.empty()) return found;
    if (above == above.parent_path()) break;
  }
  return {};
}

}  // namespace

std::vector<fs::path> resource_folders(const std::vector<fs::path>& given) {
  std::vector<fs::path> folders = given;
  for (const char* variable : {"GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH", "IGN_GAZEBO_RESOURCE_PATH", "ROS_PACKAGE_PATH"}) {
    const char* value = std::getenv(variable);
    std::string_view rest = value ? value : "";
    while (!rest.empty()) {
      const std::string_view one = rest.substr(0, rest.find(':'));
      rest.remove_prefix(std::min(rest.size(), one.size() + 1));
      if (!one.empty()) folders.emplace_back(one);
    }
  }
  return folders;
}

fs::path find_resource(std::string_view uri, const fs::path& from_file, const std::vector<fs::path>& folders) {
  const std::size_t colon = uri.find("://");
  const std::string_view scheme = colon == std::string_view::npos ? std::string_view() : uri.substr(0, colon);
  if (uri.empty() || uri.size() > 4000 || uri.find('\0') != std::string_view::npos) return {};
  std::string path = std::string(scheme.empty() ? uri : uri.substr(colon + 3));
  if (!scheme.empty()) path = without_escapes(path);
  if (scheme == "http" || scheme == "https") {  // never fetched, but a copy of the model may lie here under its name
    const std::string name = fs::path(path).filename().string();
    return name.empty() ? fs::path() : look_around(name, from_file, folders);
  }
  const fs::path wanted = fs::path(path).lexically_normal();
  if (scheme == "model" || scheme == "package")
    return wanted.is_absolute() ? fs::path() : look_around(wanted, from_file, folders);
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
    return failure(ErrorKind::bad_data, path.string() + ": is larger than 16 MiB; such files hold meshes elsewhere");
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
