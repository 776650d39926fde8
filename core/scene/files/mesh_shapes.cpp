// Reads each mesh file that a scene names once, and gives every part a material.
#include <algorithm>
#include <cstdio>

#include "core/scene/files/load_mesh.hpp"
#include "core/scene/files/shapes.hpp"
#include "core/text/nearest.hpp"

namespace sonar {

using text::Map;
using text::Node;

// Chooses the material of a part: first from `materials: {name in file: our name}`, then `material`, then our material with the
// name in the file.
std::vector<std::uint16_t> ShapeReader::assign_materials(const std::vector<std::string>& names, const std::vector<bool>& used,
                                                         Map& keys) {
  std::vector<std::uint16_t> out(names.size(), 0);
  std::vector<bool> known(names.size(), false);
  if (const Node node = keys.optional("materials")) {
    Map chosen = node.map();
    std::vector<std::string_view> valid(names.begin(), names.end());
    for (const auto& [name, material] : chosen.entries()) {
      const auto at = std::find(names.begin(), names.end(), name);
      if (at == names.end()) {
        material.fail("the mesh has no material of this name" + text::suggestion(name, valid, "its materials"));
        continue;
      }
      const std::uint16_t index = materials.named(material);
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i] == name) out[i] = index, known[i] = true;
      }
    }
  }
  const Node rest = keys.optional("material");
  const std::uint16_t rest_index = materials.named(rest);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (known[i] || !used[i]) continue;
    if (rest.present()) {
      out[i] = rest_index;
    } else if (const auto same = materials.find(names[i])) {
      out[i] = *same;
    } else {
      rest.fail("needed, because the mesh's material \"" + names[i].substr(0, 64) + "\" is unknown; set material or materials");
    }
  }
  return out;
}

namespace {

void note_losses(const std::string& name, const LoadedMesh& loaded, std::vector<std::string>& notes) {
  if (loaded.centred.left_out > 0)
    notes.push_back(name + ": " + std::to_string(loaded.centred.left_out) + " triangles without area left out");
  if (loaded.lost > 0)
    notes.push_back(name + ": " + std::to_string(loaded.lost) +
                    " of the triangles that it lists cannot be read and are "
                    "missing here; do their faces name vertices that are not there? Export it again");
  if (loaded.hidden > 0)
    notes.push_back(name + ": " + std::to_string(loaded.hidden) +
                    " triangles of parts that the file's own scene does not show are left out");
}

}  // namespace

Shape ShapeReader::read_mesh_file(Map& keys) {
  const Node file = keys.required("file");
  const std::string name = file.text(1024);
  MeshFile request;
  request.file = folder / name;
  request.folder = folder;
  for (const BuiltInFile& f : in_memory)
    if (f.name == name) request.in_memory = f.contents;
  request.scale = keys.optional("scale").number_or(1, text::Range::between(1e-9, 1e9));
  if (const Node up = keys.optional("up")) request.up = up.choice<UpAxis>({{"y", UpAxis::y}, {"z", UpAxis::z}});

  std::string key = request.file.lexically_normal().string();
  std::array<char, 64> shaped{};
  std::snprintf(shaped.data(), shaped.size(), "|%.17g|%d", request.scale, request.up ? static_cast<int>(*request.up) : -1);
  key += shaped.data();
  std::map<std::string, LoadedMesh>& read = cache != nullptr ? cache->mesh_files() : meshes;
  if (!read.contains(key)) {
    if (name.empty()) return keys.optional("material"), keys.optional("materials"), Shape{};
    auto loaded = load_mesh(request);
    if (!loaded) return keys.optional("material"), keys.optional("materials"), file.fail(loaded.error().text), Shape{};
    read.emplace(key, std::move(*loaded));
  }
  const LoadedMesh& loaded = read.at(key);
  if (noted.insert(key).second) note_losses(name, loaded, scene.notes);
  std::vector<bool> used(loaded.material_names.size(), false);
  for (const std::uint16_t m : loaded.centred.mesh.material) used[m] = true;
  const std::vector<std::uint16_t> assigned = assign_materials(loaded.material_names, used, keys);
  for (std::size_t i = 0; i < assigned.size(); ++i) key.append("|").append(used[i] ? std::to_string(assigned[i]) : "");

  const auto [place, is_new] = files.try_emplace(key);
  if (is_new)
    place->second = known_or(key, [&] {
      Mesh mesh = loaded.centred.mesh;
      for (std::uint16_t& m : mesh.material) m = assigned[m];
      return Shape{std::make_shared<const Mesh>(std::move(mesh)), loaded.centred.centre_m};
    });
  return place->second;
}

}  // namespace sonar
