#include "clients/scene_tools/imported_files.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "clients/scene_tools/resource_paths.hpp"
#include "core/scene/files/load_mesh.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/scene/shapes/terrain.hpp"

namespace sonar::scene_tools {
namespace {

namespace fs = std::filesystem;

void append(std::string& out, double v) {
  std::array<char, 32> text{};
  out.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), v).ptr);
}

/// Gazebo and RViz use the coordinates of every mesh unchanged: z is up, even if the file states another axis.
MeshFile mesh_at(const fs::path& file, const std::string& part = {}) {
  MeshFile request;
  request.file = file;
  request.part = part;
  request.up = UpAxis::z;
  return request;
}

/// Returns an OBJ text of the mesh, scaled about its origin by a factor for each axis.
std::string converted_obj(const CentredMesh& centred, Vec3d scale, bool is_centred) {
  std::string out = "# made by sonarctl scene import\n";
  for (const Vec3& v : centred.mesh.vertices) {
    const Vec3d p = to_double(v) + (is_centred ? Vec3d{} : centred.centre_m);
    out += "v ";
    append(out, scale.x * p.x), out += ' ';
    append(out, scale.y * p.y), out += ' ';
    append(out, scale.z * p.z), out += '\n';
  }
  for (const auto& t : centred.mesh.triangles)
    out += std::string("f ") + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
  return out;
}

}  // namespace

FileResolver::FileResolver(const Library& library, fs::path scene, bool skip_missing, bool try_files, Findings& findings)
    : library_(library), scene_(std::move(scene)), skip_missing_(skip_missing), try_files_(try_files), findings_(findings) {}

bool FileResolver::resolve(PlacedShape& placed) {
  const bool mesh = placed.shape.kind == Shape::Kind::mesh;
  if (!mesh && placed.shape.kind != Shape::Kind::heightmap) return true;
  const fs::path file = library_.find(placed.shape.uri, placed.at.in->path);
  if (!file.empty()) return mesh ? resolve_mesh(placed, file) : resolve_heightmap(placed, file);
  const std::string what = std::string(mesh ? "mesh " : "heightmap ") + plain(placed.shape.uri, 200);
  const std::string fetch = fetch_command(placed.shape.uri);
  if (skip_missing_)
    findings_.leave_out_missing(placed.at, what, fetch);
  else if (std::none_of(missing_.begin(), missing_.end(), [&](const Missing& known) { return known.what == what; }))
    missing_.push_back({placed.at, what, fetch});
  return false;
}

void FileResolver::report_missing() {
  if (missing_.empty()) return;
  std::string text = missing_.front().what +
                     ": the file was not found; give the folder that holds it with --model-path, or continue without it with "
                     "--skip-missing";
  for (std::size_t i = 1; i < missing_.size(); ++i) text += (i == 1 ? "; also missing: " : ", ") + missing_[i].what;
  std::vector<std::string> commands;  // one per model
  for (const Missing& m : missing_)
    if (!m.fetch.empty() && std::find(commands.begin(), commands.end(), m.fetch) == commands.end()) commands.push_back(m.fetch);
  for (const std::string& command : commands) text += (&command == &commands.front() ? "; fetch from Fuel: " : "; ") + command;
  findings_.fail(missing_.front().at, text);
}

bool FileResolver::resolve_mesh(PlacedShape& placed, const fs::path& file) {
  const std::string why = why_not(file);
  if (!why.empty()) return findings_.leave_out(placed.at, std::string("mesh ") + plain(why, 300)), false;
  Shape& shape = placed.shape;
  const Vec3d s = shape.scale;
  const bool even = s.x > 0 && std::abs(s.y - s.x) <= 1e-9 * s.x && std::abs(s.z - s.x) <= 1e-9 * s.x;
  if (!even || !shape.part.empty()) return convert(placed, file);
  shape.uri = path_to_write(file);
  return true;
}

/// The suffix gives the format; the daemon's loader checks the rest.
std::string FileResolver::why_not(const fs::path& file) {
  static constexpr std::array<const char*, 6> known{".obj", ".stl", ".ply", ".gltf", ".glb", ".dae"};
  if (std::find(known.begin(), known.end(), mesh_extension(file)) == known.end())
    return file.filename().string() + ": a scene reads OBJ, STL, PLY, glTF, GLB and DAE";
  if (!try_files_) return {};
  const auto [known_file, is_new] = tried_.try_emplace(file);
  if (is_new)
    if (const auto loaded = load_mesh(mesh_at(file)); !loaded) known_file->second = loaded.error().text;
  return known_file->second;
}

bool FileResolver::convert(PlacedShape& placed, const fs::path& file) {
  Shape& shape = placed.shape;
  std::string key = file.string();
  for (const double s : {shape.scale.x, shape.scale.y, shape.scale.z}) key += "|", append(key, s);
  key += (shape.is_centred ? "|centred|" : "|") + shape.part;
  auto [known, is_new] = known_conversions_.try_emplace(key);
  if (is_new) {
    const auto loaded = load_mesh(mesh_at(file, shape.part));
    if (!loaded) {
      known_conversions_.erase(known);
      return findings_.leave_out(placed.at, std::string("mesh ") + plain(loaded.error().text, 300)), false;
    }
    const std::string folder = scene_.stem().string() + "-meshes";
    const std::string name = file.stem().string() + "-" + std::to_string(converted_.size() + 1) + ".obj";
    converted_[scene_.parent_path() / folder / name] = converted_obj(loaded->centred, shape.scale, shape.is_centred);
    known->second = folder + "/" + name;
  }
  shape.uri = known->second;
  shape.scale = {1, 1, 1};
  return true;
}

bool FileResolver::resolve_heightmap(PlacedShape& placed, const fs::path& file) {
  const std::string what = std::string("heightmap ") + plain(placed.shape.uri, 200) + ": ";
  if (mesh_extension(file) != ".png")
    return findings_.leave_out(placed.at, what + "only grey PNG is imported; add a grid by hand, as an object of type heightmap"),
           false;
  if (try_files_) {
    const Vec3d size = placed.shape.size_m;
    const auto heights = read_png_heights(file, size.x, size.y, 0, size.z);
    if (!heights) return findings_.leave_out(placed.at, what + plain(heights.error().text, 300)), false;
    // In Gazebo the brightest pixel of the picture has the full height, in a scene white has it.
    float highest_m = 0;
    for (const float z : heights->z_m) highest_m = std::max(highest_m, std::isnan(z) ? 0 : z);
    if (highest_m > 0) placed.shape.size_m.z *= size.z / static_cast<double>(highest_m);
  }
  placed.shape.uri = path_to_write(file);
  return true;
}

/// Returns a path relative to the scene, so that both can be moved together. It is absolute if they have only the root in common.
std::string FileResolver::path_to_write(const fs::path& file) const {
  std::error_code error;
  const fs::path target = fs::weakly_canonical(fs::absolute(file, error), error);
  const fs::path folder = fs::weakly_canonical(fs::absolute(scene_, error).parent_path(), error);
  const auto [in_target, in_folder] = std::mismatch(target.begin(), target.end(), folder.begin(), folder.end());
  const bool apart = std::distance(target.begin(), in_target) < 2;
  return apart ? target.string() : target.lexically_relative(folder).generic_string();
}

Result<void> FileResolver::write_converted() {
  for (const auto& [path, text] : converted_) {
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    std::ofstream out(path, std::ios::binary);
    out << text;
    if (!out.flush())
      return failure(ErrorKind::io,
                     path.string() + ": cannot be written; check that the folder is writable and the disk is not full");
  }
  return {};
}

}  // namespace sonar::scene_tools
