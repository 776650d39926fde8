#include "core/scene/files/shapes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "core/base/letters.hpp"
#include "core/base/load_step.hpp"
#include "core/base/memory_left.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/height_values.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "core/text/file_kind.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

using namespace std::string_view_literals;
using text::Map;
using text::Node;
using text::Range;

const Range a_size{.min = 1e-4, .max = 1e5};

Shape with_material(Mesh mesh, std::uint16_t material, const Primitive& primitive = {}) {
  std::fill(mesh.material.begin(), mesh.material.end(), material);
  return Shape{std::make_shared<const Mesh>(std::move(mesh)), {}, primitive};
}

/// Makes a key. Keys are equal for equal shapes; a key contains all digits of the numbers.
std::string shape_key(std::string_view type, std::uint16_t material, std::initializer_list<double> numbers) {
  std::string key(type);
  key += ' ' + std::to_string(material);
  for (const double number : numbers) key += text::format(" %.17g", number);
  return key;
}

/// The usual extension of the grid format that the first bytes of the file show; empty if the file is not a grid.
std::string grid_by_content(const std::filesystem::path& file) {
  auto head = read_regular(file, 64);
  if (!head) return {};
  for (const std::string_view magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (head->starts_with(magic)) return ".tif";
  if (head->starts_with("\x89PNG"sv)) return ".png";
  if (head->starts_with(byte_order_mark)) head->erase(0, byte_order_mark.size());
  head->erase(0, head->find_first_not_of(" \t\r\n"));
  const std::string word = small_letters(head->substr(0, head->find_first_of(" \t\r\n=:")));
  static constexpr std::array<std::string_view, 8> header_words{"ncols",     "nrows",     "xllcorner", "yllcorner",
                                                                "xllcenter", "yllcenter", "cellsize",  "nodata_value"};
  if (std::find(header_words.begin(), header_words.end(), word) != header_words.end()) return ".asc";
  const bool is_number = !word.empty() && word.find_first_not_of("0123456789+-.,;e") == word.npos;
  return is_number && mesh_extension(file) == ".asc" ? ".xyz" : "";  // some programs write points to files named .asc
}

constexpr std::uint64_t memory_of_a_height = 64;  // bytes, while a grid becomes a mesh

Shape from_grid(const Result<HeightGrid>& grid, std::uint16_t material, const Node& at, bool centred) {
  if (!grid) return at.fail(grid.error().text), Shape{};
  if (auto room = check_memory_for("its mesh", memory_of_a_height * grid->z_m.size()); !room)
    return at.fail(room.error().text), Shape{};
  auto made = mesh_from_grid(*grid);
  if (!made) return at.fail(made.error().text), Shape{};
  Shape shape = with_material(std::move(made->mesh), material);
  shape.centre_m = made->centre_m;
  if (centred && !grid->origin) shape.centre_m.x = shape.centre_m.y = 0;  // a grid with an origin is already relative to it
  return shape;
}

Geodetic origin_from(Map keys) {
  const double latitude_deg = keys.required("lat").number(Range::between(-90, 90));
  return {rad_from_deg(latitude_deg), rad_from_deg(keys.required("lon").number(Range::between(-180, 360))), 0};
}

double in_rad(const Node& node, double fallback_deg) {
  return rad_from_deg(node.number_or(fallback_deg, Range::between(-360, 360)));
}

std::array<double, 2> one_or_two(const Node& node, std::array<double, 2> fallback, Range range) {
  if (!node.is_sequence() && node.present()) {
    const double both = node.number(range);
    return {both, both};
  }
  return node.numbers_or<2>(fallback, range);
}

SeabedShape read_seabed(Map& keys) {
  SeabedShape s;
  const auto size = keys.required("size_m").numbers<2>(a_size);
  s.size_x_m = size[0], s.size_y_m = size[1];
  const auto fine = keys.optional("fine_size_m").numbers_or<2>(size, a_size);
  s.fine_x_m = fine[0], s.fine_y_m = fine[1];
  const auto spacing = one_or_two(keys.optional("spacing_m"), {0.2, 0.2}, Range::between(1e-3, 1e3));
  s.spacing_x_m = spacing[0], s.spacing_y_m = spacing[1];
  s.seed = static_cast<std::uint32_t>(keys.optional("seed").unsigned_integer_or(1, 0xFFFFFFFFu));
  s.relief_m = keys.optional("relief_m").number_or(0.1, Range::between(0, 1000));
  s.wavelength_m = keys.optional("wavelength_m").number_or(4, Range::between(1e-2, 1e5));
  s.octaves = static_cast<int>(keys.optional("octaves").integer_or(5, 0, 16));
  s.persistence = keys.optional("persistence").number_or(0.5, Range::between(0, 1));
  s.slope = keys.optional("slope").numbers_or<2>({0, 0}, Range::between(-10, 10));
  if (const Node node = keys.optional("ripples")) {
    Map ripples = node.map();
    s.ripples.wavelength_m = ripples.required("wavelength_m").number(Range::between(1e-2, 1e3));
    s.ripples.height_m = ripples.required("height_m").number(Range::between(0, 100));
    s.ripples.direction_rad = in_rad(ripples.optional("direction_deg"), 0);
    s.ripples.bend = ripples.optional("bend").number_or(s.ripples.bend, Range::between(0, 2));
  }
  return s;
}

}  // namespace

const std::vector<std::string_view>& ShapeReader::types() {
  static const std::vector<std::string_view> names{"plane", "box",  "sphere", "cylinder",  "capsule", "cone",
                                                   "torus", "rock", "mesh",   "heightmap", "seabed"};
  return names;
}

Shape ShapeReader::read(std::string_view type, Map& keys) {
  if (type == "mesh") return read_mesh_file(keys);
  if (type == "heightmap" || type == "seabed") return read_ground(type, keys);
  return read_primitive(type, keys);
}

Shape ShapeReader::read_primitive(std::string_view type, Map& keys) {
  const std::uint16_t material = materials.named(keys.required("material"));
  const auto size_of = [&](const char* key) { return std::max(keys.required(key).number(a_size), a_size.min); };
  const auto segments = [&](double radius_m) {
    return static_cast<int>(std::max<std::int64_t>(keys.optional("segments").integer_or(segments_for(radius_m), 8, 2048), 8));
  };
  const auto patch = [&](double longest_m) {
    const Node given = keys.optional("patch_m");
    const double patch_m = std::max(given.number_or(1, Range::between(0.01, 1e5)), 0.01), least_m = longest_m / most_patches;
    if (given.present() && patch_m < least_m)
      given.fail(text::format("must be at least %.10g: an edge has at most %d patches", least_m, most_patches));
    return patch_m;
  };
  const auto three = [&](const char* key) {
    const auto v = keys.required(key).numbers<3>(a_size);
    return Vec3d{std::max(v[0], a_size.min), std::max(v[1], a_size.min), std::max(v[2], a_size.min)};
  };
  // `numbers`: all numbers on which `make` depends.
  const auto done = [&](std::initializer_list<double> numbers, const auto& make, const Primitive& primitive = {}) {
    return known_or(shape_key(type, material, numbers), [&] { return with_material(make(), material, primitive); });
  };
  if (type == "plane") {
    const auto size = keys.required("size_m").numbers<2>(a_size);
    const Vec3d sheet{std::max(size[0], a_size.min), std::max(size[1], a_size.min), 0};
    const double patch_m = patch(std::max(sheet.x, sheet.y));
    return done({sheet.x, sheet.y, patch_m}, [&] { return make_plane(sheet.x, sheet.y, patch_m); },
                {.kind = Primitive::Kind::plane, .size_m = sheet});
  }
  if (type == "box") {
    const Vec3d edges = three("size_m");
    const double patch_m = patch(std::max({edges.x, edges.y, edges.z}));
    return done({edges.x, edges.y, edges.z, patch_m}, [&] { return make_box(edges, patch_m); },
                {.kind = Primitive::Kind::box, .size_m = edges});
  }
  if (type == "rock") {
    const Vec3d size = three("size_m");
    const double bumpiness = keys.optional("bumpiness").number_or(0.2, Range::between(0, 0.5));
    const auto seed = static_cast<std::uint32_t>(keys.optional("seed").unsigned_integer_or(1, 0xFFFFFFFFu));
    const int n = static_cast<int>(std::max<std::int64_t>(keys.optional("segments").integer_or(40, 8, 512), 8));
    return done({size.x, size.y, size.z, bumpiness, static_cast<double>(seed), static_cast<double>(n)},
                [&] { return make_rock(0.5 * size, bumpiness, seed, n); });
  }
  const double radius = size_of("radius_m");
  if (type == "sphere") {
    const int n = segments(radius);
    return done({radius, static_cast<double>(n)}, [&] { return make_sphere(radius, n); },
                {.kind = Primitive::Kind::sphere, .radius_m = radius});
  }
  if (type == "torus") {
    const double tube = size_of("tube_radius_m");
    if (tube >= radius) keys.required("tube_radius_m").fail("must be smaller than radius_m");
    const double ring = std::max(radius, 1.001 * tube);
    const int n = segments(radius + tube);
    return done({ring, tube, static_cast<double>(n)}, [&] { return make_torus(ring, tube, n); });
  }
  const double length = size_of("length_m");
  if (type == "cylinder") {
    const Caps caps =
        keys.optional("caps").choice_or(Caps::both, {{"both", Caps::both}, {"bottom", Caps::bottom}, {"none", Caps::none}});
    const int n = segments(radius);
    return done(
        {radius, length, static_cast<double>(n), static_cast<double>(caps)},
        [&] { return make_cylinder(radius, length, n, caps); },
        {.kind = Primitive::Kind::cylinder, .radius_m = radius, .size_m = {0, 0, length}, .inside = caps == Caps::bottom});
  }
  if (type == "capsule") {
    const int n = segments(radius);
    return done({radius, length, static_cast<double>(n)}, [&] { return make_capsule(radius, length, n); });
  }
  const double top = keys.optional("top_radius_m").number_or(0, Range::between(0, 1e5));
  const int n = segments(std::max(radius, top));
  return done({radius, top, length, static_cast<double>(n)}, [&] { return make_cone(radius, top, length, n); });
}

Shape ShapeReader::read_ground(std::string_view type, Map& keys) {
  const std::uint16_t material = materials.named(keys.required("material"));
  if (type == "seabed") {
    const SeabedShape shape = read_seabed(keys);
    const Node size = keys.optional("size_m");
    if (shape.size_x_m <= 0 || shape.size_y_m <= 0 || shape.spacing_x_m <= 0 || shape.spacing_y_m <= 0)
      return {};  // an error has been recorded already
    if (seabed_triangles(shape) > max_mesh_triangles) {
      return size.fail("makes more than 20 million triangles; raise spacing_m or set fine_size_m"), Shape{};
    }
    begin_load_step("making the seabed", seabed_triangles(shape));
    return known_or(
        shape_key(type, material,
                  {shape.size_x_m, shape.size_y_m, shape.fine_x_m, shape.fine_y_m, shape.spacing_x_m, shape.spacing_y_m,
                   static_cast<double>(shape.seed), shape.relief_m, shape.wavelength_m, static_cast<double>(shape.octaves),
                   shape.persistence, shape.slope[0], shape.slope[1], shape.ripples.wavelength_m, shape.ripples.height_m,
                   shape.ripples.direction_rad, shape.ripples.bend}),
        [&] {
          HeightGrid grid = make_seabed(shape);
          for (const std::string& note : grid.notes) scene.notes.push_back("seabed: " + note);
          return from_grid(std::move(grid), material, size, false);
        });
  }
  const Node file = keys.required("file");
  const std::filesystem::path path = folder / file.text(1024);
  const std::string own = mesh_extension(path), by_content = grid_by_content(path);
  std::string extension = by_content.empty() ? own : by_content;
  std::error_code no_size;
  const std::uintmax_t bytes = std::filesystem::file_size(path, no_size);
  begin_load_step("reading " + path.filename().string(), no_size ? 0 : bytes / 4);
  const auto is_usable = [&] {
    const auto begin = read_regular(path, text::kind_bytes);
    const auto kind = text::unusable_kind(begin ? *begin : std::string_view(), text::FileUse::height_map);
    if (!kind.empty()) file.fail(path.filename().string() + ": " + kind);
    return kind.empty();
  };
  const auto add_notes = [&](const Result<HeightGrid>& grid) {
    if (grid)
      for (const std::string& note : grid->notes) scene.notes.push_back(path.filename().string() + ": " + note);
  };
  if (extension == ".png") {
    const auto size = keys.required("size_m").numbers<2>(a_size);
    const auto height = keys.required("height_m").numbers<2>(Range::between(-1e5, 1e5));
    if (size[0] <= 0 || size[1] <= 0 || !is_usable()) return {};
    const auto grid = read_png_heights(path, size[0], size[1], height[0], height[1]);
    add_notes(grid);
    return from_grid(grid, material, file, false);
  }
  using Read = Result<HeightGrid> (*)(const std::filesystem::path&, const HeightOptions&);
  static const std::map<std::string, Read> readers{
      {".asc", read_esri_heights}, {".xyz", read_xyz_heights}, {".tif", read_geo_tiff_heights}, {".tiff", read_geo_tiff_heights}};
  if (!is_usable()) return {};
  static constexpr std::array<std::string_view, 4> of_tables{".csv", ".txt", ".dat",
                                                             ".pts"};  // read as points, unless the content is a grid
  if (std::find(of_tables.begin(), of_tables.end(), extension) != of_tables.end()) extension = ".xyz";
  if (const auto reader = readers.find(extension); reader != readers.end()) {
    HeightOptions options{.z_scale = keys.optional("z_scale").number_or(1, Range::between(-1000, 1000))};
    const bool centred = options.centred = keys.optional("centred").boolean_or(false);
    if (const Node geographic = keys.optional("geographic")) options.geographic = geographic.boolean_or(false);
    if (const Node origin = keys.optional("origin")) {
      options.origin = origin_from(origin.map());
      if (centred) origin.fail("give origin or centred, not both");
    }
    if (const Node utm = keys.optional("utm")) {
      options.utm = utm_zone_from(utm.text(16));
      if (!options.utm) utm.fail("is not a zone of UTM; write its number and hemisphere: 33N, 56S");
    }
    if (!centred) options.world_origin = world_origin;
    const auto grid = reader->second(path, options);
    add_notes(grid);
    return from_grid(grid, material, file, centred);
  }
  static constexpr std::array<std::string_view, 8> pictures{".pgm", ".ppm", ".pnm", ".jpg", ".jpeg", ".bmp", ".gif", ".webp"};
  const std::string name = path.filename().string(), stem = path.stem().string();
  if (std::find(pictures.begin(), pictures.end(), own) != pictures.end())
    return file.fail("a picture whose format is not read; convert it: gdal_translate -of PNG " + name + " " + stem + ".png"),
           Shape{};
  if (is_mesh_extension(own)) return file.fail("a mesh, not a grid of heights; write type: mesh"), Shape{};
  if (file.present() && !path.filename().empty())
    file.fail(
        "unknown height format; use a grey .png, an ESRI ASCII grid (.asc), .xyz or GeoTIFF (.tif); others, such as NetCDF "
        "and BAG: gdal_translate -of GTiff " +
        name + " " + stem + ".tif");
  return {};
}

}  // namespace sonar
