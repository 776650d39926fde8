#include "daemon/commands/dataset/vary.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>

#include "core/base/geometry.hpp"
#include "core/base/random.hpp"
#include "core/scene/extent.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"

namespace sonar::dataset {
namespace {

constexpr auto draws_domain = static_cast<Domain>(0x76617279u);  // differs from the domains that a ping uses
constexpr std::size_t most_words = 10000;

std::uint64_t hash_of(std::string_view name) {  // FNV-1a
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return hash;
}

/// Returns two random numbers in (0, 1), with 53 bits each.
std::array<double, 2> uniforms(Seed seed, std::uint64_t ping, std::uint32_t attempt, std::string_view name) {
  // The numbers depend only on seed, name, ping and attempt, so pings can be drawn in any order and on any machine.
  const std::uint64_t hash = hash_of(name);
  RandomKey key = key_of(seed, draws_domain);
  key.domain ^= static_cast<std::uint32_t>(hash >> 32);
  key.high ^= static_cast<std::uint32_t>(ping >> 32);
  const Random4 r = philox(static_cast<std::uint32_t>(ping), attempt, static_cast<std::uint32_t>(hash), key);
  // The added half excludes 1, and also 0, whose logarithm the normal distribution would need.
  const auto open = [](std::uint32_t high, std::uint32_t low) {
    return (static_cast<double>((std::uint64_t{high >> 6} << 26) | (low >> 6)) + 0.5) / 4503599627370496.0;
  };
  return {open(r.v[0], r.v[1]), open(r.v[2], r.v[3])};
}

bool is_name(std::string_view name) {
  const auto letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  return !name.empty() && std::isdigit(static_cast<unsigned char>(name.front())) == 0 &&
         std::all_of(name.begin(), name.end(), letter);
}

/// Reads one draw. Exactly one kind is allowed, so all keys are read before they are counted.
Variation read_one(const std::string& name, const text::Node& node) {
  Variation v;
  v.name = name;
  if (!is_name(name)) node.fail("is not a name: use letters, digits and _, so that it can be used as $" + name);
  text::Map keys = node.map();
  int kinds = 0;
  const auto pair = [&](const char* key, Variation::Kind kind) {
    const text::Node n = keys.optional(key);
    if (!n.present()) return n;
    const auto ab = n.numbers<2>();
    v.kind = kind, v.a = ab[0], v.b = ab[1];
    ++kinds;
    return n;
  };
  const auto words = [&](const char* key, Variation::Kind kind) {
    const text::Node n = keys.optional(key);
    if (!n.present()) return;
    v.kind = kind;
    v.words = n.texts(1, most_words);
    ++kinds;
  };
  if (const auto n = pair("uniform", Variation::Kind::uniform); n.present() && v.a > v.b) n.fail("must go from low to high");
  if (const auto n = pair("normal", Variation::Kind::normal); n.present() && v.b < 0)
    n.fail("is [mean, deviation], and a deviation is not below 0");
  if (const auto n = pair("integer", Variation::Kind::integer);
      n.present() &&
      (v.a > v.b || v.a != std::floor(v.a) || v.b != std::floor(v.b) || std::abs(v.a) > 1e9 || std::abs(v.b) > 1e9))
    n.fail("must go from low to high, both whole numbers below 1e9");
  words("choice", Variation::Kind::choice);
  words("list", Variation::Kind::list);
  if (kinds != 1)
    node.fail("needs one of uniform: [low, high], normal: [mean, deviation], integer: [low, high], choice: [..], list: [..]");
  return v;
}

/// Returns the word of a draw. A number has nine digits, and formulas read it back from this text, so that file and formulas
/// agree.
std::string word_of(const Variation& v, Seed seed, std::uint64_t ping, std::uint32_t attempt) {
  const auto [u, w] = uniforms(seed, ping, attempt, v.name);
  switch (v.kind) {
    case Variation::Kind::uniform:
      return text::format("%.9g", v.a + (v.b - v.a) * u);
    case Variation::Kind::normal:
      return text::format("%.9g", v.a + v.b * std::sqrt(-2 * std::log(u)) * std::cos(2 * pi * w));
    case Variation::Kind::integer:
      return text::format("%.0f", std::min(v.a + std::floor((v.b - v.a + 1) * u), v.b));
    case Variation::Kind::choice:
      return v.words[std::min(static_cast<std::size_t>(u * static_cast<double>(v.words.size())), v.words.size() - 1)];
    case Variation::Kind::list:
      // A list is not random: ping 1 gets the first word, ping 2 the second, and so on.
      return v.words[(ping - 1) % v.words.size()];
  }
  return {};
}

}  // namespace

std::vector<Variation> read_variations(const text::Node& node) {
  std::vector<Variation> all;
  for (const auto& [name, value] : node.map().entries()) all.push_back(read_one(name, value));
  return all;
}

Draws draw(const std::vector<Variation>& variations, Seed seed, std::uint64_t ping, std::uint32_t attempt) {
  Draws draws;
  for (const Variation& v : variations) {
    std::string word = v.words.empty() && v.kind >= Variation::Kind::choice ? std::string() : word_of(v, seed, ping, attempt);
    if (const auto number = text::parse_decimal(word)) draws.numbers[v.name] = *number;
    draws.words[v.name] = std::move(word);
  }
  return draws;
}

double draw_uniform(Seed seed, std::uint64_t ping, std::uint32_t attempt, std::string_view name) {
  return uniforms(seed, ping, attempt, name)[0];
}

std::string put_words(std::string_view text, const std::map<std::string, std::string>& words) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t dollar = text.find('$', at);
    out += text.substr(at, dollar - at);
    if (dollar == std::string_view::npos) break;
    std::size_t end = dollar + 1;
    while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_')) ++end;
    const auto word = words.find(std::string(text.substr(dollar + 1, end - dollar - 1)));
    // A $name that is not the name of a draw is kept, because the formulas replace it later.
    out += word != words.end() ? word->second : std::string(text.substr(dollar, end - dollar));
    at = end;
  }
  return out;
}

namespace {

/// Returns the name without the index of an instance: "rock[3]" gives "rock".
std::string shared_name(const std::string& name) { return name.substr(0, name.find('[')); }

/// Returns the visible objects with that name or label, and their poses.
std::vector<std::pair<const Object*, Pose>> placed(const std::string& name, const PingRequest& request, const Scene& scene) {
  std::vector<std::pair<const Object*, Pose>> found;
  for (const Object& o : scene.objects)
    if (o.visible && is_named(o, name)) found.emplace_back(&o, scene.in_world(o, request.bodies_in_world));
  return found;
}

Vec3d middle_of(const Object& object, const Pose& in_world) { return transform(in_world, extent_of(*object.mesh).centre_m()); }

/// True if a point lies within the range, the horizontal aperture and the vertical beam width of the sonar.
bool is_in_fan(Vec3d in_world, const PingRequest& r) {
  const Vec3d p = transform(inverse(r.sonar_in_world), in_world);
  const FrequencyMode& mode = r.model->modes[static_cast<std::size_t>(r.settings.mode)];
  const double range = length(p), half_aperture = static_cast<double>(mode.horizontal_aperture_rad) / 2;
  return range >= r.settings.range_start_m && range <= r.settings.range_m && p.x > 0 &&
         std::abs(std::atan2(p.y, p.x)) <= half_aperture &&
         std::abs(std::atan2(p.z, std::hypot(p.x, p.y))) <= static_cast<double>(mode.pattern.elevation_width_rad) / 2;
}

/// Returns the largest height of an object's surface at (x, y), in the axes of the object.
std::optional<double> height_at(const Mesh& mesh, double x, double y) {
  std::optional<double> highest;
  for (const auto& corners : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices[corners[0]]), b = to_double(mesh.vertices[corners[1]]),
                c = to_double(mesh.vertices[corners[2]]);
    const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (area == 0) continue;
    // Barycentric coordinates of (x, y) in the triangle as seen from above.
    const double v = ((x - a.x) * (c.y - a.y) - (c.x - a.x) * (y - a.y)) / area;
    const double w = ((b.x - a.x) * (y - a.y) - (x - a.x) * (b.y - a.y)) / area;
    if (v < 0 || w < 0 || v + w > 1) continue;
    const double z = a.z + v * (b.z - a.z) + w * (c.z - a.z);
    if (!highest || z > *highest) highest = z;
  }
  return highest;
}

bool is_above(Vec3d place, const Object& bed, const Pose& bed_in_world) {
  const Vec3d p = transform(inverse(bed_in_world), place);
  const auto z = height_at(*bed.mesh, p.x, p.y);
  return z && p.z > *z;
}

/// Returns the box along the world axes around the rotated box of the object.
Extent box_of(const Object& object, const Pose& in_world) {
  const Extent own = extent_of(*object.mesh);
  Extent box;
  for (int corner = 0; corner < 8; ++corner)
    box.add(
        transform(in_world, Vec3d{(corner & 1) != 0 ? own.low_m.x : own.high_m.x, (corner & 2) != 0 ? own.low_m.y : own.high_m.y,
                                  (corner & 4) != 0 ? own.low_m.z : own.high_m.z}));
  return box;
}

/// True if the boxes overlap. A rotated object has a larger box, so two objects that do not touch may overlap here.
bool overlap(const Extent& a, const Extent& b) {
  return a.low_m.x < b.high_m.x && b.low_m.x < a.high_m.x && a.low_m.y < b.high_m.y && b.low_m.y < a.high_m.y &&
         a.low_m.z < b.high_m.z && b.low_m.z < a.high_m.z;
}

bool are_in_view(const Constraints& c, const PingRequest& request, const Scene& scene) {
  return std::all_of(c.in_view.begin(), c.in_view.end(), [&](const std::string& name) {
    const auto objects = placed(name, request, scene);
    // A name without visible objects is not a failure, because a draw may hide objects.
    return objects.empty() || std::any_of(objects.begin(), objects.end(),
                                          [&](const auto& o) { return is_in_fan(middle_of(*o.first, o.second), request); });
  });
}

bool are_above_bed(const Constraints& c, const PingRequest& request, const Scene& scene) {
  const auto beds = placed(c.bed, request, scene);
  if (c.above_bed.empty() || beds.empty()) return true;
  const auto& [bed, at] = beds.front();
  return std::all_of(c.above_bed.begin(), c.above_bed.end(), [&, bed = bed, at = at](const std::string& name) {
    if (name == "sonar") return is_above(request.sonar_in_world.position_m, *bed, at);
    const auto objects = placed(name, request, scene);
    return std::all_of(objects.begin(), objects.end(),
                       [&](const auto& o) { return is_above(middle_of(*o.first, o.second), *bed, at); });
  });
}

bool are_apart(const Constraints& c, const PingRequest& request, const Scene& scene) {
  std::vector<Extent> boxes;
  for (const Object& o : scene.objects)
    if (o.visible && std::any_of(c.no_overlap.begin(), c.no_overlap.end(), [&](const auto& name) { return is_named(o, name); }))
      boxes.push_back(box_of(o, scene.in_world(o, request.bodies_in_world)));
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = i + 1; j < boxes.size(); ++j)
      if (overlap(boxes[i], boxes[j])) return false;
  return true;
}

}  // namespace

bool is_named(const Object& object, const std::string& name) {
  return object.name == name || object.label == name || shared_name(object.name) == name;
}

std::set<std::string> names_of(const Scene& scene) {
  std::set<std::string> names;
  for (const Object& o : scene.objects) {
    names.insert({o.name, shared_name(o.name)});
    if (!o.label.empty()) names.insert(o.label);
  }
  return names;
}

std::string why_unknown(const Constraints& c, const std::vector<std::string>& targets, const Scene& scene) {
  const auto known = names_of(scene);
  const std::vector<std::string_view> candidates(known.begin(), known.end());
  const auto ask = [&](const char* key, const std::vector<std::string>& names) -> std::string {
    for (const std::string& name : names)
      if (!known.contains(name) && !(name == "sonar" && std::string_view(key) == "constraints.above_bed"))
        return std::string(key) + ": the scene has no object or label \"" + name + "\"" +
               text::suggestion(name, candidates, "objects and labels");
    return {};
  };
  for (const auto& [key, names] : {std::pair{"constraints.in_view", c.in_view},
                                   {"constraints.above_bed", c.above_bed},
                                   {"constraints.no_overlap", c.no_overlap},
                                   {"dataset.targets", targets}})
    if (std::string why = ask(key, names); !why.empty()) return why;
  return c.bed.empty() ? std::string() : ask("constraints.bed", {c.bed});
}

std::string Unmet::sentence() const {
  std::string text;
  for (const auto& [name, times] : {std::pair{"in_view", in_view}, {"above_bed", above_bed}, {"no_overlap", no_overlap}})
    if (times > 0) text += (text.empty() ? "" : ", ") + std::string(name) + " failed " + std::to_string(times) + " times";
  return text;
}

bool meets(const Constraints& constraints, const PingRequest& request, const Scene& scene, Unmet& unmet) {
  // The first constraint that is not met is counted; further ones are not tested.
  if (!are_in_view(constraints, request, scene)) return ++unmet.in_view, false;
  if (!are_above_bed(constraints, request, scene)) return ++unmet.above_bed, false;
  if (!are_apart(constraints, request, scene)) return ++unmet.no_overlap, false;
  return true;
}

}  // namespace sonar::dataset
