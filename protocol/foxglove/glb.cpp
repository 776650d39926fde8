#include "protocol/foxglove/glb.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace sonar::foxglove {
namespace {

using Json = nlohmann::ordered_json;

// Constants of glTF 2.0: magic number and chunk types (section 4.4), component types and targets of buffer views.
constexpr std::uint32_t magic = 0x46546C67, version = 2, chunk_json = 0x4E4F534A, chunk_bin = 0x004E4942;
constexpr int type_float = 5126, type_u32 = 5125, target_vertices = 34962, target_indices = 34963;

Vec3 y_up(Vec3 v) { return {v.x, v.z, -v.y}; }
Json list(Vec3 v) { return Json::array({v.x, v.y, v.z}); }

/// Returns the normals. The normal of a vertex is the mean of the normals of its triangles, weighted by area (the length of the
/// cross product).
std::vector<Vec3> normals_of(std::span<const Vec3> vertices, std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<Vec3> normals(vertices.size());
  for (const auto& [a, b, c] : triangles) {
    const Vec3 by_area = cross(vertices[b] - vertices[a], vertices[c] - vertices[a]);
    for (const std::uint32_t i : {a, b, c}) normals[i] = normals[i] + by_area;
  }
  for (Vec3& n : normals) {
    const float length = std::sqrt(dot(n, n));
    n = length > 0 ? (1 / length) * n : Vec3{0, 0, 1};
  }
  return normals;
}

void put(wire::Bytes& out, std::span<const Vec3> vectors) {
  wire::Writer writer(out);
  for (const Vec3& v : vectors) {
    const Vec3 turned = y_up(v);
    writer("x", turned.x);
    writer("y", turned.y);
    writer("z", turned.z);
  }
}

}  // namespace

// The layout is: a header of 12 bytes; a JSON chunk, padded with blanks to a multiple of 4; a binary chunk with positions,
// normals and indices, to which the JSON refers with buffer views and accessors.
wire::Bytes glb(std::span<const Vec3> vertices, std::span<const std::array<std::uint32_t, 3>> triangles,
                const std::array<double, 3>& colour) {
  const std::size_t vector_bytes = 12 * vertices.size(), index_bytes = 12 * triangles.size();
  const std::size_t data_bytes = 2 * vector_bytes + index_bytes;  // always a multiple of 4, as the format requires for chunks
  Vec3 least = vertices.empty() ? Vec3{} : y_up(vertices.front()), most = least;
  for (const Vec3& v : vertices) {
    const Vec3 t = y_up(v);
    least = {std::min(least.x, t.x), std::min(least.y, t.y), std::min(least.z, t.z)};
    most = {std::max(most.x, t.x), std::max(most.y, t.y), std::max(most.z, t.z)};
  }
  const auto view = [](std::size_t at, std::size_t length, int target) {
    return Json{{"buffer", 0}, {"byteOffset", at}, {"byteLength", length}, {"target", target}};
  };
  const auto accessor = [](int of_view, int component, std::size_t count, const char* type) {
    return Json{{"bufferView", of_view}, {"componentType", component}, {"count", count}, {"type", type}};
  };
  Json positions = accessor(0, type_float, vertices.size(), "VEC3");
  positions["min"] = list(least);
  positions["max"] = list(most);
  const Json material{
      {"pbrMetallicRoughness",
       {{"baseColorFactor", {colour[0], colour[1], colour[2], 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.9}}},
      {"doubleSided", true}};
  const Json primitive{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}}}, {"indices", 2}, {"material", 0}};
  const Json description{
      {"asset", {{"version", "2.0"}, {"generator", "sonard"}}},
      {"scene", 0},
      {"scenes", Json::array({{{"nodes", {0}}}})},
      {"nodes", Json::array({{{"mesh", 0}}})},
      {"meshes", Json::array({{{"primitives", Json::array({primitive})}}})},
      {"materials", Json::array({material})},
      {"buffers", Json::array({{{"byteLength", data_bytes}}})},
      {"bufferViews", Json::array({view(0, vector_bytes, target_vertices), view(vector_bytes, vector_bytes, target_vertices),
                                   view(2 * vector_bytes, index_bytes, target_indices)})},
      {"accessors", Json::array({positions, accessor(1, type_float, vertices.size(), "VEC3"),
                                 accessor(2, type_u32, 3 * triangles.size(), "SCALAR")})}};
  std::string text = description.dump();
  text.append((4 - text.size() % 4) % 4, ' ');

  constexpr std::size_t header_bytes = 12, chunk_header_bytes = 8;
  wire::Bytes out;
  const auto total = static_cast<std::uint32_t>(header_bytes + 2 * chunk_header_bytes + text.size() + data_bytes);
  out.reserve(total);
  wire::Writer writer(out);
  for (const std::uint32_t word : {magic, version, total, static_cast<std::uint32_t>(text.size()), chunk_json})
    writer("header", word);
  std::transform(text.begin(), text.end(), std::back_inserter(out), [](char c) { return static_cast<std::byte>(c); });
  for (const std::uint32_t word : {static_cast<std::uint32_t>(data_bytes), chunk_bin}) writer("header", word);
  put(out, vertices);
  put(out, normals_of(vertices, triangles));
  for (const auto& triangle : triangles)
    for (const std::uint32_t index : triangle) writer("index", index);
  return out;
}

}  // namespace sonar::foxglove
