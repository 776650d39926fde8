#include "daemon/server/view/scene_shapes.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "protocol/foxglove/foxglove_messages.hpp"
#include "protocol/foxglove/glb.hpp"

namespace sonar {
namespace {

/// This object is not shown, because seen from above it would hide everything else.
constexpr std::string_view not_shown = "sea surface";

bool is_shown(const Object& object) { return !object.name.empty() && object.name != not_shown && object.mesh != nullptr; }

ViewBytes shared(wire::Bytes bytes) { return std::make_shared<const wire::Bytes>(std::move(bytes)); }

using Colour = std::array<double, 3>;

/// Returns the colour of a material, from the first known word in its name ("rusty pipe", "quay_stone"); for other names a muted
/// colour that depends on the name.
Colour colour_of(const std::string& material) {
  struct Row {
    std::string_view word;
    Colour colour;
  };
  constexpr Colour sand{0.62, 0.57, 0.47}, rock{0.50, 0.50, 0.52}, stone{0.55, 0.58, 0.62}, steel{0.52, 0.62, 0.74};
  constexpr std::array<Row, 18> rows{{{"sand", sand},
                                      {"bed", sand},
                                      {"mud", {0.42, 0.38, 0.32}},
                                      {"gravel", {0.56, 0.53, 0.49}},
                                      {"rust", {0.58, 0.33, 0.22}},
                                      {"stone", stone},
                                      {"concrete", stone},
                                      {"tank", stone},
                                      {"rock", rock},
                                      {"steel", steel},
                                      {"metal", steel},
                                      {"alumin", {0.72, 0.75, 0.78}},
                                      {"wood", {0.47, 0.36, 0.24}},
                                      {"rubber", {0.16, 0.17, 0.18}},
                                      {"plastic", {0.86, 0.45, 0.10}},
                                      {"glass", {0.60, 0.74, 0.76}},
                                      {"ice", {0.80, 0.88, 0.93}},
                                      {"air", {0.85, 0.86, 0.80}}}};
  for (const Row& row : rows)
    if (material.find(row.word) != std::string::npos) return row.colour;
  constexpr std::array<Colour, 5> others{{sand, {0.46, 0.52, 0.56}, {0.55, 0.42, 0.36}, {0.44, 0.54, 0.44}, {0.60, 0.60, 0.58}}};
  const auto sum = std::accumulate(material.begin(), material.end(), 0u,
                                   [](unsigned n, char c) { return 31 * n + static_cast<unsigned char>(c); });
  return others[sum % others.size()];
}

Mesh bounding_box(const Mesh& mesh) {
  Vec3 least = mesh.vertices.front(), most = least;
  for (const Vec3& v : mesh.vertices) {
    least = {std::min(least.x, v.x), std::min(least.y, v.y), std::min(least.z, v.z)};
    most = {std::max(most.x, v.x), std::max(most.y, v.y), std::max(most.z, v.z)};
  }
  Mesh box;
  for (unsigned i = 0; i < 8; ++i)
    box.vertices.push_back({i & 1 ? most.x : least.x, i & 2 ? most.y : least.y, i & 4 ? most.z : least.z});
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return box;
}

}  // namespace

/// Makes the messages on the thread of the view. An object with too many triangles is shown as its bounding box.
std::vector<SceneShapes::Made> SceneShapes::make(const Job& job) {
  std::vector<Made> all;
  for (const std::size_t index : job.objects) {
    const Object& object = job.scene->objects[index];
    const bool is_too_big = object.mesh->triangles.size() > most_triangles;
    const Mesh box = is_too_big ? bounding_box(*object.mesh) : Mesh{};
    const Mesh& mesh = is_too_big ? box : *object.mesh;
    const std::string material = object.mesh->material.empty() ? "" : job.scene->materials.at(object.mesh->material.front()).name;
    const wire::Bytes glb = foxglove::glb(mesh.vertices, mesh.triangles, colour_of(material));
    const std::string frame =
        object.body < 0 ? "world" : "object/" + job.scene->body_names.at(static_cast<std::size_t>(object.body));
    foxglove::Model model{object.name, frame, job.scene->in_body(object), {{"material", material}}, glb};
    if (is_too_big)
      model.metadata.emplace_back("shape", "bounding box of " + std::to_string(object.mesh->triangles.size()) + " triangles");
    all.push_back({object.name, object, shared(foxglove::scene_update(job.at, model))});
  }
  return all;
}

/// Compares the scene with the shown objects: adds new and changed objects to the job, and deletes hidden and removed objects at
/// once. While a job runs, nothing is compared.
std::vector<ViewPayload::Piece> SceneShapes::update(const std::shared_ptr<const Scene>& scene, const World& world, Time now,
                                                    Job& job) {
  if (under_way_) return {};
  std::vector<ViewPayload::Piece> pieces;
  std::map<std::string, Shown> left = std::move(shown_);
  shown_.clear();
  for (std::size_t i = 0; i < scene->objects.size(); ++i) {
    const Object& object = scene->objects[i];
    if (!is_shown(object)) continue;
    const bool visible = object.visible && (object.body < 0 || !world.is_hidden(static_cast<std::size_t>(object.body)));
    Shown& shown = shown_[object.name];
    if (const auto before = left.find(object.name); before != left.end()) {
      shown = std::move(before->second);
      left.erase(before);
    }
    const bool was_visible = std::exchange(shown.visible, visible);
    shown.object.visible = object.visible;  // its mesh need not be made again
    if (shown.bytes == nullptr || !(shown.object == object)) job.objects.push_back(i);
    if (shown.bytes != nullptr && visible != was_visible)
      pieces.push_back({object.name, visible ? shown.bytes : shared(foxglove::scene_deletion(now, object.name))});
  }
  for (const auto& [name, gone] : left) pieces.push_back({name, shared(foxglove::scene_deletion(now, name))});
  job.scene = scene;
  job.at = now;
  under_way_ = !job.objects.empty();
  return pieces;
}

/// Takes the made objects, except those that were removed meanwhile.
std::vector<ViewPayload::Piece> SceneShapes::take(std::vector<Made> made) {
  under_way_ = false;
  std::vector<ViewPayload::Piece> pieces;
  for (Made& one : made) {
    const auto shown = shown_.find(one.name);
    if (shown == shown_.end()) continue;
    shown->second.object = std::move(one.object);
    shown->second.bytes = std::move(one.bytes);
    if (shown->second.visible) pieces.push_back({one.name, shown->second.bytes});
  }
  return pieces;
}

std::vector<ViewPayload::Piece> SceneShapes::all() const {
  std::vector<ViewPayload::Piece> pieces;
  for (const auto& [name, shown] : shown_)
    if (shown.visible && shown.bytes != nullptr) pieces.push_back({name, shown.bytes});
  return pieces;
}

}  // namespace sonar
