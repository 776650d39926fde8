// Tests every request of control.proto in both directions, hand-assembled bytes, refusals, truncations.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/protocol/control/examples.hpp"

namespace sonar::control::requests_test {
namespace {

using testing::HasSubstr;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Request round_trip(const Request& request) {
  auto back = decode_request(encode_request(request));
  EXPECT_TRUE(back) << back.error().why;
  return back ? *std::move(back) : Request{};
}
std::string refusal_of(const decltype(Request::op)& op) {
  const auto back = decode_request(encode_request({77, op}));
  if (back) return "accepted";
  EXPECT_EQ(back.error().id, 77u);
  return back.error().why;
}
void expect_near(const MountChange& a, const MountChange& b) {
  EXPECT_NEAR(length(*a.position_m - *b.position_m), 0, 1e-12);
  EXPECT_NEAR(std::abs((conjugate(*a.orientation) * *b.orientation).w), 1, 1e-12);
}
void expect_near(const Pose& a, const Pose& b) {
  EXPECT_NEAR(length(a.position_m - b.position_m), 0, 1e-12);
  EXPECT_NEAR(std::abs((conjugate(a.orientation) * b.orientation).w), 1, 1e-12);
}

TEST(ControlRequests, SettingsOfASonarArriveUnchanged) {
  const Request sent = every_request()[4];
  const Request got = round_trip(sent);
  const auto &a = std::get<SetSonar>(sent.op), &b = std::get<SetSonar>(got.op);
  EXPECT_EQ(got.id, 5u);
  EXPECT_EQ(b.sonar, "front");
  EXPECT_EQ(b.range_m, 12.5);
  EXPECT_EQ(b.rate_hz, 0.0) << "a rate of zero is standby; it is not missing";
  EXPECT_EQ(b.gain_percent, 40.0);
  EXPECT_EQ(b.mode, 1u);
  EXPECT_EQ(b.beams, 256u);
  EXPECT_EQ(b.transmit, false);
  expect_near(*b.mount, *a.mount);
  SetSonar moved;
  moved.mount = MountChange{Vec3d{0, 0, 0}, {}};
  const auto kept = std::get<SetSonar>(round_trip({1, moved}).op);
  EXPECT_EQ(kept.mount->position_m, Vec3d{}) << "the origin is a position";
  EXPECT_FALSE(kept.mount->orientation) << "an orientation that is not given stays missing";
  const auto none = std::get<SetSonar>(round_trip({1, SetSonar{}}).op);
  EXPECT_FALSE(none.range_m || none.rate_hz || none.gain_percent || none.mode || none.beams || none.transmit || none.mount);
}

TEST(ControlRequests, OtherRequestsArriveUnchanged) {
  const auto all = every_request();
  const auto hello = std::get<Hello>(round_trip(all[0]).op);
  EXPECT_EQ(hello.name, "test");
  EXPECT_EQ(hello.token, "a token of the lab");
  EXPECT_TRUE(std::holds_alternative<GetStatus>(round_trip(all[3]).op));
  const auto water = std::get<SetEnvironment>(round_trip(all[5]).op);
  EXPECT_EQ(water.temperature_c, 4.0);
  EXPECT_EQ(water.sound_speed_mps, 0.0);
  EXPECT_FALSE(water.salinity_psu || water.ph);
  EXPECT_EQ(std::get<LoadScene>(round_trip(all[6]).op).path, "harbour.yaml");
  const auto add = std::get<AddObject>(round_trip(all[7]).op);
  EXPECT_EQ(add.name + " " + add.like + " " + add.material, "crate2 crate steel");
  EXPECT_TRUE(add.moving);
  expect_near(add.in_world, std::get<AddObject>(all[7].op).in_world);
  EXPECT_EQ(std::get<RemoveObject>(round_trip(all[8]).op).object, "crate2");
  const auto set = std::get<SetObject>(round_trip(all[9]).op);
  EXPECT_EQ(set.object, "crate");
  EXPECT_EQ(set.visible, true);
  expect_near(*set.in_world, std::get<AddObject>(all[7].op).in_world);
  const auto subscribe = std::get<Subscribe>(round_trip(all[10]).op);
  EXPECT_TRUE(subscribe.pings && !subscribe.clients && subscribe.poses && !subscribe.scene);
  const auto plays = std::get<SetTrajectory>(round_trip(all[11]).op), goes_on = std::get<SetTrajectory>(round_trip(all[12]).op);
  EXPECT_TRUE(plays.of == PoseSample::Of::object && plays.name == "crate");
  EXPECT_TRUE(plays.paused == true && plays.position_s == 1.5 && plays.speed == 2.5);
  EXPECT_TRUE(goes_on.of == PoseSample::Of::vehicle && goes_on.name == "rov");
  EXPECT_TRUE(!goes_on.paused && goes_on.position_s == 0.25 && !goes_on.speed);
  EXPECT_EQ(std::get<Step>(round_trip(all[13]).op).dt_s, 0.125);
}

/// The bytes of Request{id 3, sonar: SetSonar{range_m: 5, transmit: false}}, typed by hand. Optional values are wrapper messages.
TEST(ControlRequests, HandAssembledBytesAreDecoded) {
  Bytes bytes;
  for (const unsigned b : {0x08u, 0x03u, 0x2au, 0x0du, 0x12u, 0x09u, 0x09u, 0u, 0u, 0u, 0u, 0u, 0u, 0x14u, 0x40u, 0x3au, 0x00u})
    bytes.push_back(static_cast<std::byte>(b));
  const auto request = decode_request(bytes);
  ASSERT_TRUE(request) << request.error().why;
  EXPECT_EQ(request->id, 3u);
  EXPECT_EQ(std::get<SetSonar>(request->op).range_m, 5.0);
  EXPECT_EQ(std::get<SetSonar>(request->op).transmit, false);
}

TEST(ControlRequests, RefusalsNameTheKey) {
  SetSonar sonar;
  sonar.range_m = nan;
  EXPECT_EQ(refusal_of(sonar), "sonar.range_m is NaN or infinite");
  sonar = {};
  sonar.mount = MountChange{Vec3d{0, 2000, 0}, {}};
  EXPECT_THAT(refusal_of(sonar), HasSubstr("mount.position is beyond 1000 m"));
  sonar.mount = MountChange{Vec3d{nan, 0, 0}, {}};
  EXPECT_THAT(refusal_of(sonar), HasSubstr("mount.position"));
  sonar = {};
  sonar.sonar = "front\nready";
  EXPECT_EQ(refusal_of(sonar), "sonar has control characters");
  SetEnvironment water;
  water.ph = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal_of(water), "environment.environment.ph is NaN or infinite");
  EXPECT_EQ(refusal_of(LoadScene{}), "path is missing");
  EXPECT_EQ(refusal_of(LoadScene{std::string(5000, 'x')}), "path is longer than 4096 bytes");
  EXPECT_EQ(refusal_of(AddObject{}), "name is missing");
  EXPECT_EQ(refusal_of(AddObject{"a", "", "", {}, false}), "like is missing");
  EXPECT_THAT(refusal_of(AddObject{"a", "b", "", {{0, 0, 1e9}, {}}, false}), HasSubstr("at: position is more than 1e8 m"));
  EXPECT_THAT(refusal_of(AddObject{"a", "b", "", {{}, {2, 0, 0, 0}}, false}), HasSubstr("at: orientation quaternion has norm 2"));
  EXPECT_EQ(refusal_of(RemoveObject{}), "object is missing");
  EXPECT_EQ(refusal_of(RemoveObject{std::string(300, 'x')}), "object is longer than 256 bytes");
  EXPECT_THAT(refusal_of(SetObject{"a", {}, Pose{{nan, 0, 0}, {}}}), HasSubstr("at: position has a NaN"));
  EXPECT_EQ(refusal_of(SetTrajectory{PoseSample::Of::vehicle, "", {}, nan, {}}), "set_trajectory.position_s is NaN or infinite");
  EXPECT_EQ(refusal_of(SetTrajectory{PoseSample::Of::object, "a\nb", {}, {}, {}}), "object has control characters");
  EXPECT_EQ(refusal_of(Step{nan}), "step.dt_s is NaN or infinite");
  PoseSample pose;
  pose.name = "rov\x7f";
  EXPECT_EQ(refusal_of(pose), "vehicle has control characters");
}

TEST(ControlRequests, TruncationsAndFlippedBytesAreReadOrRefusedNeverFatal) {
  for (const Request& request : every_request()) {
    const Bytes whole = encode_request(request);
    const auto try_it = [](const Bytes& bytes) {
      const auto got = decode_request(bytes);
      if (!got) {
        EXPECT_FALSE(got.error().why.empty());
        return;
      }
      const auto again = decode_request(encode_request(*got));
      EXPECT_TRUE(again) << "an accepted message can be encoded again: " << again.error().why;
    };
    for (std::size_t n = 0; n < whole.size(); ++n) try_it(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)));
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        Bytes flipped = whole;
        flipped[at] ^= static_cast<std::byte>(1 << bit);
        try_it(flipped);
      }
    }
  }
}

}  // namespace
}  // namespace sonar::control::requests_test
