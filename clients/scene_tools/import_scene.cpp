#include "clients/scene_tools/import_scene.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <set>
#include <string_view>
#include <utility>

#include "clients/scene_tools/imported_files.hpp"
#include "clients/scene_tools/resource_paths.hpp"
#include "clients/scene_tools/write_scene.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/scene/files/materials.hpp"
#include "core/text/nearest.hpp"

namespace sonar::scene_tools {
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

  /// Chooses a material from names in the files: of the appearance, the shape, the model, and the file or library of the model.
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
