#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <vector>

#include "core/scene/import/check_mesh.hpp"
#include "core/scene/import/node_graph.hpp"

namespace sonar {
namespace {

constexpr std::size_t deepest_element = 500;
constexpr std::string_view blanks = " \t\r\n";
constexpr auto none = std::string_view::npos;

struct Element {
  std::string_view name, id, label, url, count, source, offset;
};

/// `tag` is the text between "<" and ">".
Element parse_element(std::string_view tag) {
  std::size_t at = std::min(tag.find_first_of(" \t\r\n/"), tag.size());
  Element element;
  element.name = tag.substr(0, at);
  while ((at = tag.find_first_not_of(blanks, at)) != none) {
    const std::size_t equals = tag.find('=', at);
    if (equals == none) break;
    const std::size_t open = tag.find_first_of("\"'", equals);
    const std::size_t close = open == none ? none : tag.find(tag[open], open + 1);
    if (close == none) break;
    std::string_view name = tag.substr(at, equals - at);
    name = name.substr(0, name.find_first_of(blanks));
    const std::string_view value = tag.substr(open + 1, close - open - 1);
    if (name == "id") element.id = value;
    if (name == "name") element.label = value;
    if (name == "url") element.url = value;
    if (name == "count") element.count = value;
    if (name == "source") element.source = value;
    if (name == "offset") element.offset = value;
    at = close + 1;
  }
  return element;
}

/// Finds the end of the tag that begins at `at`: its ">" outside quotes.
std::size_t end_of_tag(std::string_view text, std::size_t at) {
  for (char quote = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != 0 ? c == quote : c == '"' || c == '\'') {
      quote = quote != 0 ? '\0' : c;
    } else if (c == '>' && quote == 0) {
      return at;
    }
  }
  return none;
}

/// The nodes and scenes of a file. Names are resolved as in the importer: in the library by id, else among all nodes by id or
/// name.
struct Nodes {
  NodeGraph graph;
  std::vector<std::size_t> scenes;
  std::map<std::string_view, std::size_t> library, others;
  std::vector<std::pair<std::size_t, std::string_view>> instances;  // parent, name of the child
  std::vector<std::pair<std::size_t, std::string_view>> surfaces;   // node, name of a geometry or controller
  std::string_view scene;                                           // the name of the scene that is shown

  std::size_t add(const Element& element, bool in_a_node) {
    const std::size_t node = graph.add(std::string(element.id.empty() ? element.label : element.id));
    if (!in_a_node && !element.id.empty()) library[element.id] = node;
    if (!element.id.empty()) others.try_emplace(element.id, node);
    if (!element.label.empty()) others.try_emplace(element.label, node);
    return node;
  }
  MeshFault fault() {
    for (const auto& [parent, name] : instances) {
      auto at = library.find(name);
      if (at == library.end() && (at = others.find(name)) == others.end()) continue;
      graph.contains(parent, at->second);
    }
    return graph.fault(scenes);
  }
};

std::uint64_t number_in(std::string_view text) {
  std::uint64_t n = 0;
  std::from_chars(text.data(), text.data() + text.size(), n);
  return n;
}

/// Reads the elements of geometries. Triangles are counted by the indices that primitives list, not by the counts that they
/// state.
class Geometries {
 public:
  void begin(const Element& element, std::string_view text) {
    const std::string_view name = element.name;
    if (name == "geometry") geometry_ = element.id, kind_ = {}, triangles_[geometry_];
    if (name == "controller") controller_ = element.id;
    if ((name == "skin" || name == "morph") && element.source.starts_with("#")) skin_of_[controller_] = element.source.substr(1);
    for (const char* kind : {"triangles", "polylist", "polygons", "trifans", "tristrips", "lines", "linestrips"})
      if (name == kind) kind_ = name, values_a_corner_ = 1, has_sides_ = name == "polylist";
    if (name == "input" && !kind_.empty())
      values_a_corner_ = std::max(values_a_corner_, std::min<std::uint64_t>(number_in(element.offset), 1000) + 1);
    if (name == "vcount" && has_sides_)
      each_word(text, [&](std::string_view word) { triangles_[geometry_] += std::max<std::uint64_t>(number_in(word), 2) - 2; });
    if (name != "p" || kind_.empty() || kind_.starts_with("line") || has_sides_) return;
    std::uint64_t values = 0;
    each_word(text, [&](std::string_view) { ++values; });
    const std::uint64_t corners = values / values_a_corner_;
    triangles_[geometry_] += kind_ == "triangles" ? corners / 3 : std::max<std::uint64_t>(corners, 2) - 2;
  }

  ListedFaces faces(const std::vector<std::string_view>& shown) const {
    ListedFaces faces;
    std::set<std::string_view> seen;
    for (std::string_view name : shown) {
      for (int k = 0; k < 4 && skin_of_.contains(name); ++k) name = skin_of_.at(name);
      if (const auto at = triangles_.find(name); at != triangles_.end()) faces.shown += at->second, seen.insert(name);
    }
    for (const auto& [name, count] : triangles_) faces.hidden += seen.contains(name) ? 0 : count;
    return faces;
  }

 private:
  static void each_word(std::string_view text, const auto& take) {
    for (std::size_t at = text.find_first_not_of(blanks); at != none; at = text.find_first_not_of(blanks, at)) {
      const std::size_t end = std::min(text.find_first_of(blanks, at), text.size());
      take(text.substr(at, end - at));
      at = end;
    }
  }
  std::map<std::string_view, std::uint64_t> triangles_;   // triangles of each geometry
  std::map<std::string_view, std::string_view> skin_of_;  // geometry or controller that a controller moves
  std::string_view geometry_, controller_, kind_;         // the elements that are being read
  std::uint64_t values_a_corner_ = 1;
  bool has_sides_ = false;
};

}  // namespace

MeshFault check_collada(std::string_view file, ListedFaces* faces) {
  constexpr std::size_t no_node = ~std::size_t{0};
  Nodes nodes;
  Geometries geometries;
  std::vector<std::size_t> inside;  // for each open element, the node that contains it
  const auto after = [&](std::string_view end, std::size_t at) {
    const std::size_t found = file.find(end, at);
    return found == none ? none : found + end.size();
  };
  for (std::size_t at = file.find('<'); at != none; at = at == none ? none : file.find('<', at)) {
    const std::string_view rest = file.substr(at);
    if (rest.starts_with("<!--")) {
      at = after("-->", at + 4);
    } else if (rest.starts_with("<![CDATA[")) {
      at = after("]]>", at);
    } else if (rest.starts_with("<?")) {
      at = after("?>", at);
    } else {
      const std::size_t end = end_of_tag(file, at);
      if (end == none) break;
      const std::string_view tag = file.substr(at + 1, end - at - 1);
      at = end + 1;
      if (tag.starts_with("!")) continue;
      if (tag.starts_with("/")) {
        if (!inside.empty()) inside.pop_back();
        continue;
      }
      const Element element = parse_element(tag);
      std::size_t node = inside.empty() ? no_node : inside.back();
      if (element.name == "node" || element.name == "visual_scene") {
        const std::size_t here = nodes.add(element, node != no_node);
        if (node != no_node) nodes.graph.contains(node, here);
        if (element.name == "visual_scene") nodes.scenes.push_back(here);
        node = here;
      }
      geometries.begin(element, tag.ends_with("/") ? std::string_view() : file.substr(at, file.find('<', at) - at));
      if (element.name == "instance_visual_scene" && element.url.starts_with("#")) nodes.scene = element.url.substr(1);
      if ((element.name == "instance_geometry" || element.name == "instance_controller") && node != no_node &&
          element.url.starts_with("#"))
        nodes.surfaces.emplace_back(node, element.url.substr(1));
      if (element.name == "instance_node" && node != no_node && element.url.starts_with("#"))
        nodes.instances.emplace_back(node, element.url.substr(1));
      std::uint64_t count = 0;
      const auto [stop, error] = std::from_chars(element.count.begin(), element.count.end(), count);
      if (error == std::errc::result_out_of_range || count > file.size())
        return "says that <" + std::string(element.name.substr(0, 32)) + "> has " + std::string(element.count.substr(0, 24)) +
               " values, which its " + std::to_string(file.size()) + " bytes cannot hold; it is damaged, export it again";
      if (!tag.ends_with("/")) inside.push_back(node);
      if (inside.size() > deepest_element)
        return "nests its elements deeper than " + std::to_string(deepest_element) + " levels; it is damaged, export it again";
    }
  }
  if (MeshFault fault = nodes.fault()) return fault;
  if (nodes.scene.empty())
    return "shows no scene (no <instance_visual_scene url=\"#...\"/> in <scene>), or is cut short; export it with its scene";
  if (!nodes.library.contains(nodes.scene))
    return "shows the scene \"" + std::string(nodes.scene.substr(0, 64)) + "\", which is not in the file; export it again";
  if (faces) {
    std::multimap<std::size_t, std::string_view> surfaces(nodes.surfaces.begin(), nodes.surfaces.end());
    std::vector<std::string_view> shown;
    for (const std::size_t node : nodes.graph.shown({nodes.library.at(nodes.scene)}))
      for (auto [at, end] = surfaces.equal_range(node); at != end; ++at) shown.push_back(at->second);
    *faces = geometries.faces(shown);
  }
  return std::nullopt;
}

}  // namespace sonar
