#include <algorithm>
#include <array>
#include <climits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "core/scene/import/check_mesh.hpp"
#include "core/scene/import/node_graph.hpp"

namespace sonar {
namespace {

constexpr std::size_t deepest_nesting = 200;
using Json = nlohmann::json;

/// Reads the text without storing it. Names of nodes are numbers; in glTF 1 they are words.
class GltfWalk final : public Json::json_sax_t {
 public:
  explicit GltfWalk(const std::function<bool(const std::string&)>& is_itself) : is_itself_(is_itself) {}

  MeshFault fault;
  std::map<std::string, std::vector<std::string>> children;  // children of each node
  std::vector<std::vector<std::string>> scenes;              // the nodes of each scene
  std::size_t scene = 0;                                     // the scene that is shown
  struct Primitive {
    std::string positions, indices;    // accessors
    std::vector<std::string> weights;  // accessors
    std::uint64_t mode = 4;            // triangles
  };
  std::map<std::string, std::vector<Primitive>> primitives;  // primitives of each mesh
  std::map<std::string, std::string> mesh_of;                // mesh of each node
  struct Accessor {
    std::uint64_t count = 0, type = 0;
  };
  std::map<std::string, Accessor> accessors;
  std::vector<std::string> required, used;  // extensions
  std::size_t skins = 0;
  std::set<std::string> skins_with_matrices;  // their numbers
  bool is_morphed = false;                    // true if a morph target, which moves vertices, has a weight other than 0

  bool null() override { return value({}); }
  bool boolean(bool) override { return value({}); }
  bool number_integer(number_integer_t v) override {
    note_weight(static_cast<double>(v));
    return value(std::to_string(v));
  }
  bool number_unsigned(number_unsigned_t v) override {
    note_weight(static_cast<double>(v));
    if (is_at(3, "accessors", "count")) accessors[levels_[1].name()].count = v;
    if (is_at(3, "accessors", "componentType")) accessors[levels_[1].name()].type = v;
    if (levels_.size() == 1 && levels_[0].key == "scene") scene = v;
    if (Primitive* p = primitive(); p && levels_.size() == 5 && levels_[4].key == "mode") p->mode = v;
    return value(std::to_string(v));
  }
  bool number_float(number_float_t v, const string_t&) override {
    note_weight(v);
    return value({});
  }
  bool string(string_t& v) override { return value(v); }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return open(false); }
  bool start_array(std::size_t) override { return open(true); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    levels_.back().key = name;
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const Json::exception&) override { return false; }

 private:
  struct Level {
    bool array;
    std::uint64_t index = 0;
    std::string key;
    std::string name() const { return array ? std::to_string(index) : key; }
  };

  bool is_at(std::size_t depth, const char* top, const char* last) const {
    return levels_.size() == depth && levels_[0].key == top && !levels_[2].array && levels_[2].key == last;
  }
  void note_weight(double v) { is_morphed |= v != 0 && (is_at(4, "meshes", "weights") || is_at(4, "nodes", "weights")); }
  /// Returns the primitive that is being read, or null.
  Primitive* primitive() {
    if (levels_.size() < 5 || levels_[0].key != "meshes" || levels_[2].key != "primitives" || !levels_[3].array) return nullptr;
    auto& all = primitives[levels_[1].name()];
    if (all.size() <= levels_[3].index) all.resize(levels_[3].index + 1);
    return &all.back();
  }
  bool value(const std::string& v) {
    if (Primitive* p = primitive()) {
      if (levels_.size() == 5 && levels_[4].key == "indices") p->indices = v;
      if (levels_.size() == 6 && levels_[4].key == "attributes" && levels_[5].key == "POSITION") p->positions = v;
      if (levels_.size() == 6 && levels_[4].key == "attributes" && levels_[5].key.starts_with("WEIGHTS_"))
        p->weights.push_back(v);
    }
    if (is_at(3, "skins", "inverseBindMatrices") && !v.empty()) skins_with_matrices.insert(levels_[1].name());
    if (is_at(3, "nodes", "mesh")) mesh_of[levels_[1].name()] = v;
    if (levels_.size() == 2 && levels_[0].key == "extensionsRequired") required.push_back(v);
    if (levels_.size() == 2 && levels_[0].key == "extensionsUsed") used.push_back(v);
    if (is_at(4, "nodes", "children")) children[levels_[1].name()].push_back(v);
    if (is_at(4, "scenes", "nodes")) scenes.back().push_back(v);
    if (is_at(3, "buffers", "uri") && !v.starts_with("data:")) check_file(v);
    step();
    return !fault;
  }
  /// Checks the name of a buffer's file.
  void check_file(const std::string& uri) {
    constexpr std::size_t longest = 3 * PATH_MAX;  // a path whose bytes are all escaped with %
    if (uri.size() > longest)
      fault = "names the file of a buffer with " + std::to_string(uri.size()) +
              " characters; put the file beside it and name it without a folder";
    else if (uri.starts_with("/") || uri.starts_with("\\") || uri.find(':') == 1)
      fault = "names the file " + uri.substr(0, 200) + ", an absolute path; put the file beside it and name it without a folder";
    else if (is_itself_ && is_itself_(uri))  // each such buffer would take the memory of the file again
      fault = "names itself as the file of a buffer (" + uri.substr(0, 200) + "); export it again";
  }
  bool open(bool array) {
    if (levels_.size() == 2 && levels_[0].key == "scenes") scenes.emplace_back();
    if (levels_.size() == 2 && levels_[0].key == "nodes") children[levels_[1].name()];
    skins += levels_.size() == 2 && levels_[0].key == "skins";
    levels_.push_back({array, 0, {}});
    if (levels_.size() > deepest_nesting)
      fault = "nests its JSON deeper than " + std::to_string(deepest_nesting) + " levels; it is damaged, export it again";
    return !fault;
  }
  bool close() {
    levels_.pop_back();
    step();
    return true;
  }
  void step() {
    if (!levels_.empty() && levels_.back().array) ++levels_.back().index;
  }

  const std::function<bool(const std::string&)>& is_itself_;
  std::vector<Level> levels_;
};

/// Reads a whole number of four bytes. Bytes beyond the end of the file count as 0.
std::uint64_t number_at(std::string_view file, std::size_t at) {
  std::uint64_t v = 0;
  for (std::size_t k = 4; k-- > 0;) v = v << 8 | (at + k < file.size() ? static_cast<unsigned char>(file[at + k]) : 0u);
  return v;
}

constexpr std::size_t json_at = 20;  // after magic, version, length, length of the first part, its kind

std::uint64_t triangles_of(const GltfWalk& walk, const GltfWalk::Primitive& primitive) {
  const auto at = walk.accessors.find(primitive.indices.empty() ? primitive.positions : primitive.indices);
  const std::uint64_t corners = at == walk.accessors.end() ? 0 : at->second.count;
  constexpr std::uint64_t triangles = 4, strip = 5, fan = 6;  // other modes are points and lines
  if (primitive.mode == triangles) return corners / 3;
  return (primitive.mode == strip || primitive.mode == fan) && corners > 2 ? corners - 2 : 0;
}

/// Finds extensions that change surfaces or the storage of their data. The importer would ignore them without an error.
MeshFault unread_extension(const GltfWalk& walk) {
  const auto unread = [](const std::string& name) {
    const bool packed = name.find("meshopt_compression") != name.npos;
    return "needs the extension " + name.substr(0, 64) + ", which is not read; " +
           (packed ? "unpack it: gltf-transform copy IN OUT.glb" : "export it without");
  };
  static constexpr std::array<std::string_view, 10> harmless{
      "KHR_materials_", "KHR_texture_",  "KHR_lights_", "KHR_draco_mesh_compression", "KHR_xmp",
      "EXT_texture_",   "MSFT_texture_", "EXT_lights_", "KHR_mesh_quantization",      "KHR_techniques_webgl"};
  for (const std::string& name : walk.required)
    if (std::none_of(harmless.begin(), harmless.end(), [&](std::string_view begin) { return name.starts_with(begin); }))
      return unread(name);
  if (std::find(walk.used.begin(), walk.used.end(), "EXT_mesh_gpu_instancing") != walk.used.end())
    return unread("EXT_mesh_gpu_instancing");
  if (walk.is_morphed)
    return "is shaped by morph targets (its weights are not 0), which are not read; apply them, then export it again";
  return std::nullopt;
}

/// True if the importer would misread positions, or weights of bones, as floating-point numbers.
bool has_whole_numbers(const GltfWalk& walk) {
  constexpr std::uint64_t floating = 5126;
  const auto is_whole = [&](const std::string& accessor) {
    const auto at = walk.accessors.find(accessor);
    return at != walk.accessors.end() && at->second.type != floating;
  };
  for (const auto& [name, primitives] : walk.primitives)
    for (const GltfWalk::Primitive& p : primitives)
      if (is_whole(p.positions) || std::any_of(p.weights.begin(), p.weights.end(), is_whole)) return true;
  return false;
}

/// Counts the triangles of a file of version 2.
ListedFaces faces_of(const GltfWalk& walk, const NodeGraph& graph, const std::map<std::string, std::size_t>& number,
                     const std::vector<std::size_t>& scenes) {
  std::map<std::string, std::uint64_t> triangles;
  for (const auto& [mesh, primitives] : walk.primitives)
    for (const GltfWalk::Primitive& p : primitives) triangles[mesh] += triangles_of(walk, p);
  ListedFaces faces;
  if (walk.scene >= scenes.size()) return faces;
  std::vector<std::string> mesh_at(number.size() + scenes.size());
  for (const auto& [node, mesh] : walk.mesh_of)
    if (const auto at = number.find(node); at != number.end()) mesh_at[at->second] = mesh;
  std::set<std::string> seen;
  for (const std::size_t node : graph.shown({scenes[walk.scene]}))
    if (const auto at = triangles.find(mesh_at[node]); at != triangles.end()) faces.shown += at->second, seen.insert(at->first);
  for (const auto& [mesh, count] : triangles) faces.hidden += seen.contains(mesh) ? 0 : count;
  return faces;
}

}  // namespace

MeshFault check_gltf(std::string_view file, ListedFaces* faces, const std::function<bool(const std::string& uri)>& is_itself) {
  const std::string_view text = json_of_gltf(file);
  GltfWalk walk(is_itself);
  Json::sax_parse(text.begin(), text.end(), &walk, Json::input_format_t::json, false);
  if (walk.fault) return walk.fault;
  NodeGraph graph;
  std::map<std::string, std::size_t> number;
  std::vector<std::size_t> roots;
  for (const auto& [name, children] : walk.children) number[name] = graph.add(name);
  const auto link = [&](std::size_t parent, const std::vector<std::string>& children) {
    for (const std::string& child : children)
      if (const auto at = number.find(child); at != number.end()) graph.contains(parent, at->second);
  };
  for (const auto& [name, children] : walk.children) link(number[name], children);
  for (const auto& nodes : walk.scenes) {
    roots.push_back(graph.add("scene"));
    link(roots.back(), nodes);
  }
  if (MeshFault fault = graph.fault(roots)) return fault;
  if (file.starts_with("glTF") && file.substr(4, 1) == "\1") return std::nullopt;  // version 1
  if (MeshFault fault = unread_extension(walk)) return fault;
  if (faces) {
    *faces = faces_of(walk, graph, number, roots);
    faces->needs_floats = has_whole_numbers(walk) || walk.skins > walk.skins_with_matrices.size();
  }
  return std::nullopt;
}

std::string_view json_of_gltf(std::string_view file) {
  if (!file.starts_with("glTF") || file.size() < json_at) return file;
  return file.substr(json_at, number_at(file, json_at - 8));
}

std::string_view binary_part_of_glb(std::string_view file) {
  constexpr std::size_t chunk_head = 8;
  if (!file.starts_with("glTF") || file.size() < json_at) return {};
  const std::uint64_t at = json_at + number_at(file, json_at - 8);
  if (at + chunk_head > file.size() || file.substr(at + 4, 4) != std::string_view("BIN\0", 4)) return {};
  return file.substr(at + chunk_head, number_at(file, at));
}

MeshFault glb_fault(std::string_view file) {
  constexpr std::size_t head = 12, chunk_head = 8;
  const auto number = [&](std::size_t at) { return number_at(file, at); };
  const auto bytes = [](std::uint64_t n) { return std::to_string(n) + " bytes"; };
  if (!file.starts_with("glTF"))
    return "not a GLB file: it does not begin with glTF; it may be a .gltf, or a link of Git LFS in place of the file";
  if (file.size() < head + chunk_head) return "ends within its head, after " + bytes(file.size()) + "; fetch or export it again";
  const std::uint64_t version = number(4), length = number(8);
  if (version == 1) return std::nullopt;
  if (version != 2) return "is GLB of version " + std::to_string(version) + "; export it as glTF 2.0";
  if (length > file.size())
    return "is cut short: it announces " + bytes(length) + " and has " + bytes(file.size()) + "; fetch or export it again";
  int chunk = 0;
  for (std::size_t at = head; at + chunk_head <= file.size(); ++chunk) {
    const std::uint64_t size = number(at);
    const char* name = chunk == 0 ? "JSON" : "binary";
    if (chunk == 0 && file.substr(at + 4, 4) != "JSON") return "its first chunk is not JSON; export it again";
    if (size > file.size() - at - chunk_head)
      return std::string("its ") + name + " chunk of " + bytes(size) +
             " goes beyond the end of the file; fetch or export it again";
    if (size % 4 != 0)
      return std::string("its ") + name + " chunk has " + bytes(size) +
             ", and GLB requires a multiple of 4, filled up with blanks or zeros; export it again";
    at += chunk_head + static_cast<std::size_t>(size);
  }
  if (length < head + chunk_head + number(head))
    return "its head announces " + bytes(length) + ", less than its JSON takes; export it again";
  if (chunk == 1 && file.find("\"uri\"") == file.npos)
    return "has no binary chunk behind its JSON (byte " + std::to_string(head + chunk_head + number(head)) +
           "), where a GLB keeps its vertices; export it again as one .glb file with its buffers";
  return std::nullopt;
}

std::string unknown_gltf(std::string_view file) {
  const std::string_view text = json_of_gltf(file);
  return Json::accept(text.begin(), text.end()) ? "is no valid glTF of version 1 or 2 (asset, version); export it as glTF 2.0"
                                                : "its JSON is damaged; fetch or export it again";
}

}  // namespace sonar
