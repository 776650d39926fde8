#include "clients/scene_tools/import_scene.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <set>
#include <string_view>
#include <utility>

#include "clients/scene_tools/resource_paths.hpp"
#include "clients/scene_tools/write_scene.hpp"
#include "core/scene/files/load_mesh.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/scene/files/materials.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/scene/shapes/terrain.hpp"
#include "core/text/nearest.hpp"

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

/// Returns why a mesh cannot be used: its suffix is unknown, or the daemon's loader refuses it.
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

namespace {

namespace fs = std::filesystem;

/// Returns the names of the materials that every scene has.
std::set<std::string> material_names() {
  std::set<std::string> names;
  if (const auto library = text::parse_yaml(material_library_yaml, "materials.yaml"))
    for (const auto& [name, unused] : library->root().entries()) names.insert(name);
  return names;
}

std::string suggestion(const std::string& name, const std::set<std::string>& known, std::string_view label) {
  const std::vector<std::string_view> views(known.begin(), known.end());
  return text::suggestion(name, views, label);
}

/// Splits a name into words in small letters: "Gazebo/WoodFloor_2" into gazebo, wood and floor.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  bool open = false;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    const bool capital = c >= 'A' && c <= 'Z', small = c >= 'a' && c <= 'z';
    const bool begins = !open || (capital && i > 0 && name[i - 1] >= 'a' && name[i - 1] <= 'z');
    if ((capital || small) && begins) words.emplace_back();
    if (capital || small) words.back() += static_cast<char>(c | 32);
    open = capital || small;
  }
  return words;
}

/// Words in names and the materials that they stand for, besides the names of the materials themselves.
constexpr auto meanings = std::to_array<std::pair<std::string_view, std::string_view>>(
    {{"silt", "mud"},           {"clay", "mud"},        {"ooze", "mud"},      {"muddy", "mud"},       {"sandy", "sand"},
     {"beach", "sand"},         {"dune", "sand"},       {"dunes", "sand"},    {"pebble", "gravel"},   {"pebbles", "gravel"},
     {"cobble", "gravel"},      {"shingle", "gravel"},  {"rocks", "rock"},    {"rocky", "rock"},      {"stone", "rock"},
     {"stones", "rock"},        {"boulder", "rock"},    {"boulders", "rock"}, {"cliff", "rock"},      {"reef", "rock"},
     {"coral", "rock"},         {"granite", "rock"},    {"basalt", "rock"},   {"cement", "concrete"}, {"brick", "concrete"},
     {"bricks", "concrete"},    {"iron", "steel"},      {"rust", "steel"},    {"rusty", "steel"},     {"stainless", "steel"},
     {"aluminum", "aluminium"}, {"wooden", "wood"},     {"timber", "wood"},   {"plank", "wood"},      {"tyre", "rubber"},
     {"tire", "rubber"},        {"neoprene", "rubber"}, {"pvc", "plastic"},   {"acrylic", "plastic"}, {"iceberg", "ice"}});
/// Words for ground of any material.
constexpr auto ground_words = std::to_array<std::string_view>(
    {"heightmap", "seabed", "seafloor", "bathymetry", "terrain", "seamount", "ground", "riverbed", "lakebed", "sediment"});

class MaterialChooser {
 public:
  static Result<MaterialChooser> from(const std::vector<std::string>& given, const ImportedWorld& world) {
    MaterialChooser chooser;
    for (const std::string& text : given) {
      const std::size_t equals = text.find('=');
      const std::string name = equals == std::string::npos ? text : text.substr(equals + 1);
      if (!chooser.known_.contains(name))
        return failure(ErrorKind::usage, std::string("--material ") + text + ": no material \"" + name + "\"" +
                                             suggestion(name, chooser.known_, "materials"));
      if (equals == std::string::npos) {
        chooser.for_all_ = name;
        continue;
      }
      const std::string model = text.substr(0, equals);
      if (!unknown_models(world, {model}).empty())
        return failure(ErrorKind::usage, std::string("--material ") + text + ": no model of that name");
      chooser.for_model_.emplace_back(model, name);
    }
    return chooser;
  }

  /// Chooses a material: that of --material, else by words in the names of appearance, shape, link, model and mesh, else a
  /// default.
  std::string choose(const PlacedShape& shape, const ImportedModel& model) const {
    for (const auto& [path, name] : for_model_)
      if (model.path == path || model.path.starts_with(path + "/")) return name;
    if (!for_all_.empty()) return for_all_;
    bool is_ground = shape.shape.kind == Shape::Kind::plane || shape.shape.kind == Shape::Kind::heightmap;
    for (const std::string& hint :
         {shape.material, shape.label, shape.link, model.path, model.source, fs::path(shape.shape.uri).stem().string()})
      for (const std::string& word : words_of(hint)) {
        if (known_.contains(word)) return word;
        for (const auto& [other, material] : meanings)
          if (word == other) return std::string(material);
        is_ground = is_ground || std::find(ground_words.begin(), ground_words.end(), word) != ground_words.end();
      }
    return is_ground ? "sand" : "concrete";
  }

 private:
  std::set<std::string> known_ = material_names();
  std::string for_all_;
  std::vector<std::pair<std::string, std::string>> for_model_;
};

Result<void> check_moving(const ImportOptions& options, const ImportedWorld& world) {
  for (const std::string& name : unknown_models(world, options.moving)) {
    std::set<std::string> known;
    for (const ImportedModel& m : world.models) known.insert(plain(m.path, 200));
    return failure(ErrorKind::usage,
                   std::string("--moving ") + name + ": no model of that name" + suggestion(name, known, "models"));
  }
  return {};
}

Result<void> write_file(const fs::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (out.flush()) return {};
  return failure(ErrorKind::io, path.string() + ": cannot be written; check that its folder exists and is writable");
}

}  // namespace

Result<Imported> import_scene(const ImportOptions& options) {
  std::error_code error;
  if (!options.overwrite && fs::exists(options.out, error))
    return failure(ErrorKind::usage, options.out.string() + ": exists already; --overwrite replaces it");
  const Result<std::string> text = read_text(options.file);
  if (!text) return tl::make_unexpected(text.error());
  Findings findings;
  const Library library = library_on_disk(options.model_folders);
  Result<ImportedWorld> world = read_world(*text, options.file, library, options.read, findings);
  if (!world) return tl::make_unexpected(world.error());

  if (const auto sound = check_moving(options, *world); !sound) return tl::make_unexpected(sound.error());
  const auto materials = MaterialChooser::from(options.materials, *world);
  if (!materials) return tl::make_unexpected(materials.error());
  FileResolver files(library, options.out, options.read.skip_missing, options.check, findings);
  std::erase_if(world->shapes, [&](PlacedShape& shape) { return !files.resolve(shape); });
  files.report_missing();
  if (findings.failed()) return tl::make_unexpected(*findings.error());
  if (world->shapes.empty()) {
    std::string why = options.file.string() + ": nothing in it has a shape that a scene can hold";
    constexpr std::size_t most = 20;
    const std::vector<std::string> left_out = findings.left_out();
    for (std::size_t i = 0; i < std::min(most, left_out.size()); ++i)
      why += (i == 0 ? "; left out: " : "; ") + plain(left_out[i], 400);
    return failure(ErrorKind::bad_data, why);
  }
  for (PlacedShape& shape : world->shapes) shape.material = materials->choose(shape, world->models[shape.model]);

  const WriteOptions writing{.moving = options.moving, .offset_m = options.offset_m, .command = options.file.filename().string()};
  if (const auto done = files.write_converted(); !done) return tl::make_unexpected(done.error());
  const std::string scene = scene_text(*world, findings.left_out(), writing);
  if (const auto done = write_file(options.out, scene); !done) return tl::make_unexpected(done.error());
  if (options.check)
    if (const auto loaded = load_scene(options.out); !loaded) return tl::make_unexpected(loaded.error());
  return Imported{world->models.size(), world->shapes.size(), files.converted(), findings.left_out()};
}

}  // namespace sonar::scene_tools
