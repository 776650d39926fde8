// Edited copies of scenes: unchanged objects keep their positions, and errors list the objects and materials of the scene.
#include "daemon/emulator/world/edit_scene.hpp"

#include <gmock/gmock.h>

#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

control::AddObject added(const std::string& name, const std::string& like = "box", bool moving = false) {
  return {name, like, {}, Pose{{1, 2, 3}, {}}, moving};
}
std::vector<std::string> names_of(const Scene& scene) {
  std::vector<std::string> names;
  for (const Object& o : scene.objects) names.push_back(o.name);
  return names;
}

TEST(EditScene, AnObjectIsAddedAtTheEnd) {
  const auto scene = small_scene(true);
  const auto more = with_object(*scene, added("buoy"));
  ASSERT_TRUE(more) << more.error().text;
  EXPECT_THAT(names_of(**more), ElementsAre("floor", "box", "crate", "buoy"));
  const Object& buoy = (*more)->objects[3];
  EXPECT_EQ(buoy.mesh, scene->objects[1].mesh) << "the shape is shared";
  EXPECT_EQ(buoy.in_world.position_m.y, 2);
  EXPECT_EQ(buoy.body, -1);
  ASSERT_TRUE((*more)->ray_origin) << "rays have the same coordinates as before";
  EXPECT_EQ(scene->objects.size(), 3u) << "the first scene is unchanged";
}

TEST(EditScene, ACopyMayHaveAnotherMaterial) {
  control::AddObject asked = added("buoy");
  asked.material = "steel";
  const auto more = with_object(*small_scene(), asked);
  ASSERT_TRUE(more);
  EXPECT_THAT((*more)->objects[2].mesh->material, ElementsAre(1, 1));
  EXPECT_THAT((*more)->objects[1].mesh->material, ElementsAre(0, 0));
  asked.material = "steal";
  const auto unknown = with_object(*small_scene(), asked);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().text, HasSubstr("no material \"steal\"; did you mean \"steel\"?"));
}

TEST(EditScene, TheNextObjectGetsTheSlotOfARemovedObject) {
  const auto less = without_object(*small_scene(true), "box");
  ASSERT_TRUE(less);
  EXPECT_THAT(names_of(**less), ElementsAre("floor", "", "crate"));
  EXPECT_FALSE((*less)->objects[1].visible);
  EXPECT_TRUE((*less)->objects[1].mesh->triangles.empty());
  const auto more = with_object(**less, added("buoy", "floor"));
  ASSERT_TRUE(more);
  EXPECT_THAT(names_of(**more), ElementsAre("floor", "buoy", "crate"));
  EXPECT_TRUE((*more)->objects[1].visible);
}

TEST(EditScene, AFullSceneAcceptsAnObjectAfterARemoval) {
  const auto scene = small_scene(true);
  scene->objects.resize(20000, Object{.name = "stone", .mesh = small_mesh(), .in_world = {}});
  const auto full = with_object(*scene, added("buoy"));
  ASSERT_FALSE(full);
  EXPECT_THAT(full.error().text, HasSubstr("the scene has 20000 objects already"));
  const auto less = without_object(*scene, "box");
  ASSERT_TRUE(less);
  const auto again = with_object(**less, added("buoy", "floor"));
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ((*again)->objects.size(), 20000u);
  EXPECT_EQ((*again)->objects[1].name, "buoy");
}

TEST(EditScene, MovingObjectsComeAndGoWithTheirBodies) {
  const auto more = with_object(*small_scene(true), added("whale", "crate", true));
  ASSERT_TRUE(more);
  EXPECT_THAT((*more)->body_names, ElementsAre("crate", "whale"));
  EXPECT_EQ((*more)->bodies_in_world[1].position_m.x, 1);
  EXPECT_EQ((*more)->objects[3].body, 1);
  const auto less = without_object(**more, "crate");
  ASSERT_TRUE(less);
  EXPECT_THAT((*less)->body_names, ElementsAre("whale"));
  EXPECT_EQ((*less)->objects[3].body, 0) << "the index of the later body decreases";
}

TEST(EditScene, ABodyStaysWhileAnObjectIsAttachedToIt) {
  const auto scene = small_scene(true);
  scene->objects.push_back(Object{.name = "lamp", .mesh = small_mesh(), .in_world = {{5, 0, -2}, {}}, .body = 0});
  const auto less = without_object(*scene, "crate");
  ASSERT_TRUE(less);
  EXPECT_THAT((*less)->body_names, ElementsAre("crate"));
  const auto moved = with_object_set(*scene, {"lamp", {}, Pose{}});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().text, HasSubstr("moves with \"crate\""));
  const auto hidden = with_object_set(*scene, {"lamp", false, {}});
  ASSERT_TRUE(hidden);
  EXPECT_FALSE((*hidden)->objects[3].visible);
}

TEST(EditScene, StaticObjectsAreHiddenAndMoved) {
  const auto set = with_object_set(*small_scene(), {"box", false, Pose{{9, 0, 0}, {}}});
  ASSERT_TRUE(set);
  EXPECT_FALSE((*set)->objects[1].visible);
  EXPECT_EQ((*set)->objects[1].in_world.position_m.x, 9);
}

TEST(EditScene, ErrorsListTheKnownNames) {
  const auto scene = small_scene(true);
  scene->point_targets.push_back({"ping pong ball", {1, 0, 0}, -40, -1});
  const auto why = [](const Result<ScenePointer>& r) { return r ? "" : r.error().text; };
  EXPECT_THAT(why(without_object(*scene, "boks")), HasSubstr("no object \"boks\""));
  EXPECT_THAT(why(without_object(*scene, "crete")), HasSubstr("did you mean \"crate\"?"));
  EXPECT_THAT(why(without_object(*scene, "")), HasSubstr("no object \"\""));
  EXPECT_THAT(why(without_object(*scene, "ping pong ball")), HasSubstr("is a point target"));
  EXPECT_THAT(why(with_object(*scene, added("box"))), HasSubstr("already"));
  EXPECT_THAT(why(with_object(*scene, added("ping pong ball"))), HasSubstr("already"));
  EXPECT_THAT(why(with_object(*scene, added(""))), HasSubstr("needs a name"));
  EXPECT_THAT(why(with_object(*scene, added("a\nb"))), HasSubstr("printable"));
  EXPECT_THAT(why(with_object(*scene, added("x", "nothing"))), HasSubstr("no object \"nothing\""));
}

TEST(EditScene, EqualScenesAreRecognised) {
  const auto scene = small_scene(true);
  EXPECT_TRUE(is_same(*scene, *small_scene(true)));
  EXPECT_FALSE(is_same(*scene, *small_scene(false)));
  const auto differs = [&](auto&& change) {
    const auto other = small_scene(true);
    change(*other);
    return !is_same(*scene, *other);
  };
  EXPECT_TRUE(differs([](Scene& s) { s.objects[1].in_world.position_m.x += 1e-9; }));
  EXPECT_TRUE(differs([](Scene& s) { s.objects[1].visible = false; }));
  EXPECT_TRUE(differs([](Scene& s) { s.materials[1].roughness_m *= 2; }));
  EXPECT_TRUE(differs([](Scene& s) { s.bodies_in_world[0].position_m.y = 1; }));
  EXPECT_TRUE(differs([](Scene& s) { s.water_column.volume_db = -60; }));
  EXPECT_TRUE(differs([](Scene& s) {
    auto mesh = std::make_shared<Mesh>(*s.objects[0].mesh);
    mesh->vertices[0].x = 0.25f;
    s.objects[0].mesh = mesh;
  }));
  EXPECT_FALSE(differs([](Scene& s) { s.name = "other"; }));
}

}  // namespace
}  // namespace sonar::testing_daemon
