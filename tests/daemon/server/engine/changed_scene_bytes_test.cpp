// Uses the real engine. If a change of the scene is outside the view of a ping, no bit of the ping changes, because all other
// objects keep their speckle and the coordinates of their rays.
#include <gtest/gtest.h>

#include "core/paper/paper_engine.hpp"
#include "core/scene/files/load_scene.hpp"
#include "daemon/emulator/world/edit_scene.hpp"
#include "protocol/vendor.hpp"

namespace sonar {
namespace {

class ChangedScene : public ::testing::Test {
 protected:
  ChangedScene() : scene_(*load_built_in_scene("demo.yaml")) {}

  /// Makes a ping from the west of the demo, looking east over its middle.
  std::vector<std::byte> ping(const ScenePointer& scene) {
    const auto profile = protocol::find_profile("oculus-m1200d");
    protocol::DeviceState device;
    device.model = profile->model;
    device.options = *protocol::check_options(*profile->vendor, {});
    protocol::SettingsOverride wanted;
    wanted.range_m = 8;
    wanted.beams = 256;
    device.settings = profile->vendor->initial_settings(device).vendor_settings;
    PingRequest request;
    request.model = profile->model;
    request.number = PingNumber(1);
    request.settings = profile->vendor->apply_override(wanted, device)->settings;
    request.sonar_in_world = {{-7, 0, -3}, quat_from_rpy({0, rad_from_deg(15), 0})};
    request.vehicle_in_world = request.sonar_in_world;
    request.bodies_in_world = scene->bodies_in_world;
    request.seed = Seed(1);
    return make_engine(scene, pool_)->run({&request, 1}).at(0).samples;
  }
  ScenePointer with(const std::string& name, Vec3d place, bool moving) {
    const Object* like = nullptr;
    for (const Object& o : scene_->objects)
      if (like == nullptr || o.mesh->triangles.size() < like->mesh->triangles.size()) like = &o;
    auto added = with_object(*scene_, {name, like->name, {}, Pose{place, {}}, moving});
    EXPECT_TRUE(added) << added.error().text;
    return *added;
  }

  Parallel pool_;
  ScenePointer scene_;
};

TEST_F(ChangedScene, AnObjectAddedOutOfSightChangesNoBit) {
  const auto before = ping(scene_);
  EXPECT_EQ(ping(with("astern", {-60, 3, -2}, false)), before);
  EXPECT_EQ(ping(with("astern", {-60, 3, -2}, true)), before) << "a moving object changes no bit either";
  const ScenePointer gone = *without_object(*with("astern", {-60, 3, -2}, false), "astern");
  EXPECT_EQ(ping(gone), before);
}

TEST_F(ChangedScene, AnObjectAddedInSightChangesThePing) {
  const auto before = ping(scene_);
  const ScenePointer more = with("ahead", {-4, 0, -3.6}, false);
  EXPECT_NE(ping(more), before);
  control::SetObject hide;
  hide.object = "ahead";
  hide.visible = false;
  EXPECT_EQ(ping(*with_object_set(*more, hide)), before) << "a hidden object changes no bit";
}

}  // namespace
}  // namespace sonar
