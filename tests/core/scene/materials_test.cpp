// Materials: the keys of the file format, the library that every scene may use, and the error texts of invalid materials.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "core/scene/files/load_scene.hpp"

namespace sonar::materials_test {
namespace {

using ::testing::HasSubstr;

std::string a_ball_of(const std::string& material) {
  return "objects:\n  - {type: sphere, radius_m: 1, material: " + material + "}\n";
}
Result<std::shared_ptr<const Scene>> read(const std::string& materials, const std::string& used) {
  return parse_scene("materials: {" + materials + "}\n" + a_ball_of(used), "s.yaml", ".");
}
Material material(const std::string& materials, const std::string& used) {
  const auto scene = read(materials, used);
  if (!scene) throw std::runtime_error(scene.error().text);
  return (*scene)->materials.at(0);
}
std::string refusal(const std::string& keys) {
  const auto scene = read("it: {" + keys + "}", "it");
  return scene ? "accepted" : scene.error().text;
}

TEST(Materials, EveryFieldHasAKey) {
  const Material m = material(
      "it: {law: gsab, lambert_db: -25, gsab: {a_db: -9, b_deg: 10, c_db: -30, d: 3, e_db: -20, f_deg: 40}, "
      "trend_db_per_decade: 12, trend_reference_hz: 300000, roughness_m: 0.002, reflection: -0.5, "
      "texture: {shape: 2, correlation_m: 0.25}, texture_seed: 77}",
      "it");
  EXPECT_EQ(m.law, ScatteringLaw::gsab);
  EXPECT_FLOAT_EQ(m.lambert_db, -25);
  EXPECT_FLOAT_EQ(m.gsab.a_db, -9);
  EXPECT_FLOAT_EQ(m.gsab.b_rad, static_cast<float>(rad_from_deg(10)));
  EXPECT_FLOAT_EQ(m.gsab.c_db, -30);
  EXPECT_FLOAT_EQ(m.gsab.d, 3);
  EXPECT_FLOAT_EQ(m.gsab.e_db, -20);
  EXPECT_FLOAT_EQ(m.gsab.f_rad, static_cast<float>(rad_from_deg(40)));
  EXPECT_FLOAT_EQ(m.trend_db_per_decade, 12);
  EXPECT_FLOAT_EQ(m.trend_reference_hz, 300000);
  EXPECT_FLOAT_EQ(m.roughness_m, 0.002f);
  EXPECT_FLOAT_EQ(m.reflection, -0.5f);
  EXPECT_FLOAT_EQ(m.texture.shape, 2);
  EXPECT_FLOAT_EQ(m.texture.correlation_m, 0.25f);
  EXPECT_EQ(m.texture_seed, 77u);
}

TEST(Materials, LikeKeepsWhatIsNotGiven) {
  const Material m = material(
      "base: {law: gsab, gsab: {a_db: -11, b_deg: 7, c_db: -26}, texture: {shape: 4, correlation_m: 0.3}}, "
      "it: {like: base, gsab: {c_db: -28}, texture: {shape: 8}}",
      "it");
  EXPECT_EQ(m.law, ScatteringLaw::gsab);
  EXPECT_FLOAT_EQ(m.gsab.a_db, -11);
  EXPECT_FLOAT_EQ(m.gsab.c_db, -28);
  EXPECT_FLOAT_EQ(m.texture.shape, 8);
  EXPECT_FLOAT_EQ(m.texture.correlation_m, 0.3f);
}

TEST(Materials, TheLibraryHasTheNamesWePromise) {
  std::map<std::string, Material> library;
  for (const char* name : {"mud", "sand", "gravel", "rock", "concrete", "steel", "metal", "aluminium", "wood", "rubber",
                           "plastic", "glass", "ice", "air", "mud_gsab", "sand_gsab", "gravel_gsab"}) {
    const auto scene = parse_scene(a_ball_of(name), "s.yaml", ".");
    ASSERT_TRUE(scene) << name;
    const Material& m = library[name] = (*scene)->materials.at(0);
    EXPECT_EQ(m.texture.shape, 0) << name << ": no patches without a request";
    EXPECT_EQ(m.trend_db_per_decade, 0) << name;
    EXPECT_EQ(m.law, std::string(name).ends_with("_gsab") ? ScatteringLaw::gsab : ScatteringLaw::lambert) << name;
  }
  EXPECT_EQ(library["air"].reflection, -1);
  EXPECT_EQ(library["metal"].lambert_db, library["steel"].lambert_db);
  EXPECT_EQ(library["metal"].reflection, library["steel"].reflection);
  EXPECT_FLOAT_EQ(library["sand_gsab"].gsab.a_db, -8);
  EXPECT_FLOAT_EQ(library["mud_gsab"].gsab.b_rad, static_cast<float>(rad_from_deg(5)));
  EXPECT_FLOAT_EQ(library["gravel_gsab"].gsab.c_db, -15);
  // From the hardest to the softest, with known reflections in water.
  for (const auto& [harder, softer] :
       {std::pair{"steel", "aluminium"}, {"aluminium", "concrete"}, {"rock", "sand"}, {"sand", "mud"}, {"mud", "rubber"}})
    EXPECT_GT(library[harder].reflection, library[softer].reflection) << harder << " " << softer;
}

TEST(Materials, ImpossibleValuesAreRefused) {
  EXPECT_THAT(refusal("lambert_db: -4"), HasSubstr("materials.it.lambert_db"));
  EXPECT_THAT(refusal("law: gsab, gsab: {a_db: -6, c_db: -10}"),
              HasSubstr("materials.it.gsab: backscatters more than 1/pi (-4.97 dB) at normal incidence"));
  EXPECT_EQ(refusal("law: gsab, gsab: {a_db: -6, c_db: -15}"), "accepted");
  EXPECT_THAT(refusal("gsab: {a_db: -12}"), HasSubstr("materials.it.gsab: has no effect under law: lambert; add law: gsab"));
  EXPECT_THAT(refusal("law: gsab, gsab: {a_db: -3}"), HasSubstr("gsab.a_db"));
  EXPECT_THAT(refusal("law: gsab, gsab: {b_deg: 1}"), HasSubstr("gsab.b_deg"));
  EXPECT_THAT(refusal("law: gsab, gsab: {b: 8}"), HasSubstr("gsab.b: unknown key"));
  EXPECT_THAT(refusal("law: gsap"), HasSubstr("gsab"));
  EXPECT_THAT(refusal("texture: {shape: 0.1}"), HasSubstr("texture: shape is 0 (no texture) or at least 0.2"));
  EXPECT_THAT(refusal("texture: {shape: -1}"), HasSubstr("texture.shape"));
  EXPECT_THAT(refusal("texture: {shape: 1, correlation_m: 0}"), HasSubstr("texture.correlation_m"));
  EXPECT_THAT(refusal("trend_db_per_decade: 100"), HasSubstr("trend_db_per_decade"));
  EXPECT_THAT(refusal("trend_reference_hz: 0"), HasSubstr("trend_reference_hz"));
  EXPECT_THAT(refusal("reflection: -1.1"), HasSubstr("reflection"));
  EXPECT_THAT(refusal("roughness_m: .nan"), HasSubstr("roughness_m"));
}

}  // namespace
}  // namespace sonar::materials_test
