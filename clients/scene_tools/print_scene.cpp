// A description of a scene as text and as JSON.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "clients/scene_tools/import_scene.hpp"
#include "core/text/format.hpp"

namespace sonar::scene_tools {
namespace {

using text::format;
using text::joined;

/// Formats a number with three significant digits, without trailing zeros or exponent.
std::string short_number(double v) {
  const double size = std::abs(v);
  const int decimals = size == 0 || size >= 1e6 ? 0 : std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 4);
  std::string out = format("%.*f", decimals, v);
  if (out.find('.') != std::string::npos) out.erase(out.find_last_not_of('0') + 1);
  if (out.ends_with('.')) out.pop_back();
  return out == "-0" ? "0" : out;
}

using Row = std::vector<std::string>;

/// Formats columns of minimal width; those in `right` are right-aligned.
std::string table(const std::vector<Row>& rows, const std::vector<std::size_t>& right) {
  std::vector<std::size_t> width(rows.front().size(), 0);
  for (const Row& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  std::string out;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(width[c] - row[c].size(), ' ');
      const bool is_right_aligned = std::find(right.begin(), right.end(), c) != right.end();
      line += (c ? "  " : "") + (is_right_aligned ? blanks + row[c] : row[c] + blanks);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

std::string state_of(const DescribedObject& o) {
  std::string state = o.moves_with.empty() ? "" : o.moves_with == o.name ? "moving" : std::string("with ") + o.moves_with;
  if (!o.visible) state += state.empty() ? "hidden" : ", hidden";
  return state;
}

std::string extent_text(const Extent& e) {
  if (e.empty()) return "nothing";
  const auto axis = [](const char* name, double low, double high) {
    return name + short_number(low) + ".." + short_number(high);
  };
  return axis("x ", e.low_m.x, e.high_m.x) + ", " + axis("y ", e.low_m.y, e.high_m.y) + ", " + axis("z ", e.low_m.z, e.high_m.z) +
         " m";
}

std::string counted(std::size_t n, const char* one, const char* many) { return grouped(n) + " " + (n == 1 ? one : many); }

nlohmann::json json_of(Vec3d v) { return {v.x, v.y, v.z}; }

nlohmann::json json_of(const Extent& e) {
  if (e.empty()) return nullptr;
  return {{"low_m", json_of(e.low_m)}, {"high_m", json_of(e.high_m)}};
}

nlohmann::json json_of(const DescribedObject& o) {
  nlohmann::json out{{"name", o.name},
                     {"type", o.kind},
                     {"materials", o.materials},
                     {"triangles", o.triangles},
                     {"visible", o.visible},
                     {"size_m", json_of(o.own.size_m())},
                     {"centre_m", json_of(o.in_world.centre_m())},
                     {"in_world", json_of(o.in_world)}};
  out["file"] = o.file.empty() ? nlohmann::json() : nlohmann::json(o.file);
  out["moves_with"] = o.moves_with.empty() ? nlohmann::json() : nlohmann::json(o.moves_with);
  return out;
}

}  // namespace

std::string grouped(std::size_t number) {
  const std::string digits = std::to_string(number);
  std::string out;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += ' ';
    out += digits[i];
  }
  return out;
}
std::string length_text(double v) { return v < 0.1 ? short_number(1e3 * v) + " mm" : short_number(v) + " m"; }
std::string size_text(Vec3d s) { return short_number(s.x) + " x " + short_number(s.y) + " x " + short_number(s.z); }
std::string place_text(Vec3d p) {
  return std::string("(") + short_number(p.x) + ", " + short_number(p.y) + ", " + short_number(p.z) + ")";
}
std::string bytes_text(std::size_t bytes) {
  const double b = static_cast<double>(bytes);
  return b < 1e6 ? format("%.0f kB", b / 1e3) : format("%.1f MB", b / 1e6);
}

std::string summary_of(const SceneDescription& scene) {
  std::string out = counted(scene.objects.size(), "object", "objects");
  if (!scene.moving.empty()) out += std::string(" (") + grouped(scene.moving.size()) + " moving)";
  out += std::string(", ") + counted(scene.materials.size(), "material", "materials") + ", " +
         counted(scene.triangles, "triangle", "triangles") + ", " + bytes_text(scene.mesh_bytes) + " of meshes, " +
         extent_text(scene.in_world);
  return out;
}

std::string table_of(const SceneDescription& scene) {
  std::string out = scene.name + ": " + summary_of(scene) + "\n\n";
  std::vector<Row> objects{{"object", "type", "material", "triangles", "size [m]", "centre [m]", ""}};
  for (const DescribedObject& o : scene.objects) {
    const bool point = o.kind == "point";
    objects.push_back({o.name, o.kind, joined(o.materials), point ? "" : grouped(o.triangles),
                       point ? "" : size_text(o.own.size_m()), place_text(o.in_world.centre_m()), state_of(o)});
  }
  out += table(objects, {3}) + "\n";
  std::vector<Row> materials{{"material", "law", "strength [dB]", "roughness [mm]", "reflection", "objects", "triangles"}};
  for (const DescribedMaterial& m : scene.materials)
    materials.push_back({m.name, m.law, format("%.1f", m.strength_db), short_number(1e3 * m.roughness_m),
                         format("%.2f", m.reflection), grouped(m.objects), grouped(m.triangles)});
  if (materials.size() > 1) out += table(materials, {2, 3, 4, 5, 6});
  if (scene.other_sonars > 0) out += std::string("other sonars: ") + grouped(scene.other_sonars) + "\n";
  if (scene.volume_db > -150) out += std::string("water column: ") + format("%.0f", scene.volume_db) + " dB per cubic metre\n";
  const Remarks remarks = remarks_on(scene);
  for (const std::string& warning : remarks.warnings) out += std::string("warning: ") + warning + "\n";
  for (const std::string& note : remarks.notes) out += std::string("note: ") + note + "\n";
  return out;
}

std::string json_of(const SceneDescription& scene) {
  const Remarks remarks = remarks_on(scene);
  nlohmann::json out{{"name", scene.name},
                     {"triangles", scene.triangles},
                     {"mesh_bytes", scene.mesh_bytes},
                     {"moving", scene.moving},
                     {"sea_surface", scene.sea_surface},
                     {"other_sonars", scene.other_sonars},
                     {"unused_materials", scene.unused_materials},
                     {"warnings", remarks.warnings},
                     {"notes", remarks.notes},
                     {"in_world", json_of(scene.in_world)}};
  out["volume_db"] = scene.volume_db > -150 ? nlohmann::json(scene.volume_db) : nlohmann::json();
  out["objects"] = nlohmann::json::array();
  for (const DescribedObject& o : scene.objects) out["objects"].push_back(json_of(o));
  out["materials"] = nlohmann::json::array();
  for (const DescribedMaterial& m : scene.materials)
    out["materials"].push_back({{"name", m.name},
                                {"law", m.law},
                                {"strength_db", m.strength_db},
                                {"roughness_m", m.roughness_m},
                                {"reflection", m.reflection},
                                {"objects", m.objects},
                                {"triangles", m.triangles}});
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace sonar::scene_tools
