#include "core/scene/files/materials.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/base/units.hpp"
#include "core/text/nearest.hpp"

namespace sonar {
namespace {

using text::Range;

float read_number(text::Map& keys, const char* key, float fallback, Range range) {
  return static_cast<float>(keys.optional(key).number_or(static_cast<double>(fallback), range));
}
float read_angle_rad(text::Map& keys, const char* key, float fallback_rad) {
  const text::Node node = keys.optional(key);
  // Below 2 degrees the table of the kernels would be too coarse.
  return node.present() ? static_cast<float>(rad_from_deg(node.number(Range::between(2, 90)))) : fallback_rad;
}

GsabLaw read_gsab(const text::Node& node, GsabLaw law) {
  text::Map keys = node.map();
  const Range strength = Range::between(-200, largest_lambert_db);
  law.a_db = read_number(keys, "a_db", law.a_db, strength);
  law.b_rad = read_angle_rad(keys, "b_deg", law.b_rad);
  law.c_db = read_number(keys, "c_db", law.c_db, strength);
  law.d = read_number(keys, "d", law.d, Range::between(0.5, 10));
  law.e_db = read_number(keys, "e_db", law.e_db, strength);
  law.f_rad = read_angle_rad(keys, "f_deg", law.f_rad);
  // All three terms are strongest at normal incidence.
  double sum = 0;
  for (const float db : {law.a_db, law.c_db, law.e_db}) sum += power_from_db(static_cast<double>(db));
  if (10 * std::log10(sum) > largest_lambert_db)
    node.fail(
        "backscatters more than 1/pi (-4.97 dB) at normal incidence, more than the incident energy; lower a_db, c_db or e_db");
  return law;
}

Texture read_texture(const text::Node& node, Texture texture, double shortest_m) {
  text::Map keys = node.map();
  texture.shape = read_number(keys, "shape", texture.shape, Range::between(0, 100));
  texture.correlation_m = read_number(keys, "correlation_m", texture.correlation_m, Range::between(shortest_m, 100));
  if (texture.shape != 0 && texture.shape < 0.2f) node.fail("shape is 0 (no texture) or at least 0.2");
  return texture;
}

}  // namespace

MaterialTable::MaterialTable(Scene& scene) : scene_(scene), definitions_(library()) {}

/// The library is parsed only once, because data sets read thousands of scenes.
const std::vector<Material>& MaterialTable::library() {
  static const std::vector<Material> materials = [] {
    auto document = text::parse_yaml(material_library_yaml, "materials.yaml", {.error_kind = ErrorKind::bug});
    if (!document) throw std::logic_error(document.error().text);
    Scene none;
    MaterialTable table(none, {});
    table.read(document->root());
    if (const auto error = document->finish()) throw std::logic_error(error->text);
    return table.definitions_;
  }();
  return materials;
}

void MaterialTable::read(text::Map materials) {
  for (auto& [name, node] : materials.entries()) {
    if (definitions_.size() >= 2000) return node.fail("more than 2000 materials");
    read_one(name, node.map());
  }
}

void MaterialTable::read_one(const std::string& name, text::Map keys) {
  Material m;
  if (const text::Node like = keys.optional("like")) {
    if (const Material* other = definition(like.text(64))) {
      m = *other;
    } else {
      like.fail("unknown material \"" + like.text(64) + "\"" + text::suggestion(like.text(64), names(), "known materials"));
    }
  }
  m.name = name;
  m.law = keys.optional("law").choice_or(m.law, {{"lambert", ScatteringLaw::lambert}, {"gsab", ScatteringLaw::gsab}});
  m.lambert_db = read_number(keys, "lambert_db", m.lambert_db, Range::between(-80, largest_lambert_db));
  if (const text::Node node = keys.optional("gsab")) {
    if (m.law != ScatteringLaw::gsab) node.fail("has no effect under law: lambert; add law: gsab");
    m.gsab = read_gsab(node, m.gsab);
  }
  m.trend_db_per_decade = read_number(keys, "trend_db_per_decade", m.trend_db_per_decade, Range::between(-40, 40));
  m.trend_reference_hz = read_number(keys, "trend_reference_hz", m.trend_reference_hz, Range::between(1e4, 1e7));
  m.roughness_m = read_number(keys, "roughness_m", m.roughness_m, Range::between(0, 1));
  m.reflection = read_number(keys, "reflection", m.reflection, Range::between(-1, 1));
  if (const text::Node node = keys.optional("texture")) m.texture = read_texture(node, m.texture, 0.02);
  if (const text::Node node = keys.optional("grain")) m.grain = read_texture(node, m.grain, 0.002);
  m.texture_seed = static_cast<std::uint32_t>(keys.optional("texture_seed").unsigned_integer_or(m.texture_seed, 0xFFFFFFFFu));
  m.label = keys.optional("label").text_or(m.label, 64);
  if (Material* known = definition(name)) {
    *known = m;
  } else {
    definitions_.push_back(m);
  }
}

Material* MaterialTable::definition(std::string_view name) {
  const auto found = std::find_if(definitions_.begin(), definitions_.end(), [&](const Material& m) { return m.name == name; });
  return found == definitions_.end() ? nullptr : &*found;
}

std::vector<std::string_view> MaterialTable::names() const {
  std::vector<std::string_view> out;
  for (const Material& m : definitions_) out.push_back(m.name);
  return out;
}

std::uint16_t MaterialTable::add(Material material) {
  scene_.materials.push_back(std::move(material));
  return static_cast<std::uint16_t>(scene_.materials.size() - 1);
}

std::optional<std::uint16_t> MaterialTable::find(std::string_view name) {
  for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
    if (scene_.materials[i].name == name) return static_cast<std::uint16_t>(i);
  }
  const Material* m = definition(name);
  return m ? std::optional(add(*m)) : std::nullopt;
}

std::uint16_t MaterialTable::named(const text::Node& node) {
  if (!node.present()) return 0;
  const std::string name = node.text(256);
  const auto index = name.empty() ? std::nullopt : find(name);
  if (!index) node.fail("unknown material \"" + name + "\"" + text::suggestion(name, names(), "known materials"));
  return index.value_or(0);
}

}  // namespace sonar
