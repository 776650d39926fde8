#include "core/scene/materials.hpp"

#include <algorithm>
#include <stdexcept>

#include "core/text/nearest.hpp"

namespace sonar {

MaterialTable::MaterialTable(Scene& scene) : scene_(scene) {
  auto library = text::parse_yaml(material_library_yaml, "materials.yaml", {.error_kind = ErrorKind::bug});
  if (!library) throw std::logic_error(library.error().text);
  read(library->root());
  if (const auto error = library->finish()) throw std::logic_error(error->text);
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
  const auto number = [&](const char* key, float fallback, text::Range range) {
    return static_cast<float>(keys.optional(key).number_or(static_cast<double>(fallback), range));
  };
  m.lambert_db = number("lambert_db", m.lambert_db, text::Range::between(-80, -4.97));
  m.roughness_m = number("roughness_m", m.roughness_m, text::Range::between(0, 1));
  m.reflection = number("reflection", m.reflection, text::Range::between(-1, 1));
  m.texture_seed = static_cast<std::uint32_t>(keys.optional("texture_seed").unsigned_integer_or(m.texture_seed, 0xFFFFFFFFu));
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
