// Tests the lines with poses of Gazebo's models for sonard, from stand-ins for Gazebo's messages. sonard's reader reads them.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "clients/gazebo_bridge/model_poses.hpp"
#include "protocol/control/json_pose.hpp"

namespace sonar::clients {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

// The accessors of ignition.msgs.Pose_V that are used.
struct Stamp {
  std::int64_t s = 0;
  std::int32_t ns = 0;
  std::int64_t sec() const { return s; }
  std::int32_t nsec() const { return ns; }
};
struct Header {
  Stamp at;
  const Stamp& stamp() const { return at; }
};
struct Vector {
  Vec3d v;
  double x() const { return v.x; }
  double y() const { return v.y; }
  double z() const { return v.z; }
};
struct Turn {
  Quatd q;
  double w() const { return q.w; }
  double x() const { return q.x; }
  double y() const { return q.y; }
  double z() const { return q.z; }
};
struct NamedPose {
  std::string called;
  Vector place;
  Turn turn;
  const std::string& name() const { return called; }
  const Vector& position() const { return place; }
  const Turn& orientation() const { return turn; }
};
struct Poses {
  Header head;
  std::vector<NamedPose> poses;
  const Header& header() const { return head; }
  int pose_size() const { return static_cast<int>(poses.size()); }
  const NamedPose& pose(int i) const { return poses[static_cast<std::size_t>(i)]; }
};

const Quatd bow_north = quat_from_rpy({0.1, -0.2, pi / 2});

Poses message_at(std::int64_t s, std::int32_t ns = 0) {
  return {{{s, ns}},
          {{"ground", {}, {}}, {"rov", {{1, -2, -3}}, {bow_north}}, {"rov", {{9, 9, 9}}, {}}, {"buoy", {{4, 5, 0}}, {}}}};
}

TEST(GazeboBridge, WritesPosesThatSonardReads) {
  std::vector<FollowedModel> followed{parse_followed("rov").value()};
  const auto lines = lines_from(message_at(12, 500'000'000), followed);
  ASSERT_THAT(lines, SizeIs(1));
  const auto sample = control::parse_json_pose(lines[0]);
  ASSERT_TRUE(sample) << sample.error().text;
  EXPECT_EQ(sample->sent_in, control::Frame::enu_flu);
  EXPECT_EQ(sample->stamp.ns, 12'500'000'000);
  EXPECT_EQ(sample->name, "");
  EXPECT_EQ(sample->pose.position_m.y, -2);
  EXPECT_EQ(sample->pose.position_m.z, -3);
  EXPECT_NEAR(rotate(sample->pose.orientation, {1, 0, 0}).y, std::cos(0.2), 1e-12);  // the bow
}

TEST(GazeboBridge, FollowsSeveralModelsUnderSonardsNames) {
  std::vector<FollowedModel> followed{parse_followed("rov=front").value(), parse_followed("buoy=second").value()};
  const auto lines = lines_from(message_at(1), followed);
  ASSERT_THAT(lines, SizeIs(2));
  EXPECT_EQ(control::parse_json_pose(lines[0])->name, "front");
  EXPECT_EQ(control::parse_json_pose(lines[1])->name, "second");
  EXPECT_EQ(control::parse_json_pose(lines[1])->pose.position_m.x, 4);
}

TEST(GazeboBridge, SendsEachTimeOnce) {
  std::vector<FollowedModel> followed{parse_followed("rov").value()};
  EXPECT_THAT(lines_from(message_at(7), followed), SizeIs(1));
  EXPECT_THAT(lines_from(message_at(7), followed), IsEmpty()) << "paused";
  EXPECT_THAT(lines_from(message_at(7, 1), followed), SizeIs(1));
  EXPECT_THAT(lines_from(message_at(0), followed), SizeIs(1)) << "the world was reset";
}

TEST(GazeboBridge, LeavesOutWhatSonardWouldRefuse) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(json_line({{nan, 0, 0}, {}}, 0, ""));
  EXPECT_FALSE(json_line({{0, 0, 0}, {nan, 0, 0, 0}}, 0, ""));
  EXPECT_FALSE(json_line({{0, 0, 0}, {0, 0, 0, 0}}, 0, ""));
  std::vector<FollowedModel> followed{parse_followed("absent").value()};
  EXPECT_THAT(lines_from(message_at(1), followed), IsEmpty());
}

TEST(GazeboBridge, NamesAreCheckedAtTheStart) {
  EXPECT_EQ(parse_followed("a=b")->vehicle, "b");
  for (const char* bad : {"", "=b", "a="}) EXPECT_FALSE(parse_followed(bad)) << bad;
}

}  // namespace
}  // namespace sonar::clients
