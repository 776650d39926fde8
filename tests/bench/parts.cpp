#include "tests/bench/parts.hpp"

#include <algorithm>

namespace sonar::bench {
namespace {

// unknown: plausible values with a visible effect; a part costs the same at any level.
constexpr float texture_shape = 2, volume_db = -70, crosstalk_db = -40, leak_upa = 4e5f, none_db = -150;

bool is_listed(const std::vector<std::string>& parts, const char* part) {
  return std::find(parts.begin(), parts.end(), part) != parts.end();
}
bool has_texture(const Scene& scene) {
  return std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) { return m.texture.shape > 0; });
}

}  // namespace

std::vector<std::string> parts_to_give() { return {"texture", "volume", "crosstalk", "leak"}; }

std::shared_ptr<const Scene> with_parts(std::shared_ptr<const Scene> scene, const std::vector<std::string>& parts) {
  const bool texture = is_listed(parts, "texture") && !has_texture(*scene);
  const bool volume = is_listed(parts, "volume") && !scene->water_column.has_volume();
  if (!texture && !volume) return scene;
  auto given = std::make_shared<Scene>(*scene);
  if (volume) given->water_column.volume_db = volume_db;
  if (texture)
    for (Material& m : given->materials) m.texture.shape = texture_shape;
  return given;
}

std::shared_ptr<const SonarModel> with_parts(std::shared_ptr<const SonarModel> model, const std::vector<std::string>& parts) {
  if (!is_listed(parts, "crosstalk") && !is_listed(parts, "leak")) return model;
  auto given = std::make_shared<SonarModel>(*model);
  for (FrequencyMode& mode : given->modes) {
    if (is_listed(parts, "crosstalk") && mode.receiver.crosstalk_db < none_db) mode.receiver.crosstalk_db = crosstalk_db;
    if (is_listed(parts, "leak") && !(mode.receiver.leak_upa > 0)) mode.receiver.leak_upa = leak_upa;
  }
  return given;
}

std::vector<std::string> parts_had(const Scene& scene, const FrequencyMode& mode) {
  std::vector<std::string> had;
  if (has_texture(scene)) had.push_back("texture");
  if (scene.water_column.has_volume()) had.push_back("volume");
  if (mode.receiver.crosstalk_db >= none_db) had.push_back("crosstalk");
  if (mode.receiver.leak_upa > 0) had.push_back("leak");
  return had;
}

}  // namespace sonar::bench
