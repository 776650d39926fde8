// Gazebo worlds and URDFs with any text: the result is a world or a sentence that starts with the file's name, and the scene file
// written from a world can be loaded. Includes refer to the text itself, so that circles and large numbers of includes are
// tested.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "clients/scene_tools/write_scene.hpp"
#include "core/scene/files/load_scene.hpp"

namespace {

using sonar::scene_tools::ImportedWorld;
using sonar::scene_tools::PlacedShape;
using sonar::scene_tools::Shape;

/// Returns true if the shapes are few and small enough to be converted to triangles ten thousand times.
bool is_quick(const ImportedWorld& world) {
  if (world.shapes.size() > 8) return false;
  for (const PlacedShape& placed : world.shapes) {
    const Shape& s = placed.shape;
    if (s.radius_m > 0.1 || s.length_m > 10 || s.size_m.x > 10 || s.size_m.y > 10 || s.size_m.z > 10) return false;
  }
  return true;
}

void write_and_load(ImportedWorld& world, const std::vector<std::string>& left_out) {
  std::erase_if(world.shapes, [](const PlacedShape& placed) {
    return placed.shape.kind == Shape::Kind::mesh || placed.shape.kind == Shape::Kind::heightmap;
  });
  for (PlacedShape& placed : world.shapes) placed.material = "rock";
  sonar::scene_tools::WriteOptions options;
  if (!world.models.empty()) options.moving = {world.models.front().path};
  const std::string text = scene_text(world, left_out, options);
  if (is_quick(world) && !sonar::parse_scene(text, "s.yaml", "no-such-folder")) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 8192) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  sonar::scene_tools::Library library;
  library.find = [](std::string_view uri, const std::filesystem::path&) {
    return std::filesystem::path(uri.starts_with("model://") ? "itself.sdf" : "");
  };
  library.read = [&](const std::filesystem::path&) -> sonar::Result<std::string> { return std::string(text); };
  for (const bool collisions : {false, true}) {
    sonar::scene_tools::ReadOptions options;
    options.collisions = collisions;
    options.skip_missing = true;
    sonar::scene_tools::Findings findings;
    auto world = read_world(text, "w.sdf", library, options, findings);
    if (!world && !world.error().text.starts_with("w.sdf:") && !world.error().text.starts_with("itself.sdf:")) std::abort();
    if (world) write_and_load(*world, findings.left_out());
  }
  return 0;
}
