// Tests JSON lines: ArduPilot's keys, texts of refusals, and lines that are split at any byte.
#include "protocol/control/json_pose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/plausible_angles.hpp"
#include "tests/is_sanitized.hpp"

namespace sonar::control {
namespace {

using testing::HasSubstr;

std::string why(std::string_view line) {
  const auto s = parse_json_pose(line);
  return s ? std::string("accepted") : s.error().text;
}

TEST(JsonPose, ReadsArduPilotsKeys) {
  const auto s = parse_json_pose(
      R"({"timestamp":1.5,"imu":{"gyro":[0,0,0],"accel_body":[0,0,-9.8]},"position":[1,2,3],"attitude":[0,0.1,1.5707963267948966],"velocity":[0,2,0]})");
  ASSERT_TRUE(s) << s.error().text;
  EXPECT_EQ(s->stamp.domain, ClockDomain::sim);
  EXPECT_EQ(s->stamp.ns, 1500000000);
  EXPECT_EQ(s->pose.position_m.x, 2);
  EXPECT_EQ(s->pose.position_m.y, 1);
  EXPECT_EQ(s->pose.position_m.z, -3);
  EXPECT_NEAR(deg_from_rad(heading_rad(s->pose.orientation)), 90, 1e-9);
  const Vec3d ahead = rotate(s->pose.orientation, {1, 0, 0});
  EXPECT_NEAR(ahead.z, std::sin(0.1), 1e-12) << "positive pitch is bow up";
  ASSERT_TRUE(s->velocity_mps);
  EXPECT_NEAR(s->velocity_mps->x, 2 * std::cos(0.1), 1e-12) << "2 m/s to the east while heading east is ahead in body axes";
  EXPECT_EQ(s->fields, "timestamp position attitude velocity");
  EXPECT_EQ(s->sent_in, Frame::ned_frd);
}

TEST(JsonPose, ReadsQuaternionFrameAndVehicle) {
  const auto s = parse_json_pose(R"({"position":[1,2,-3],"quaternion":[1,0,0,0],"frame":"ENU_FLU","vehicle":"rov"})");
  ASSERT_TRUE(s) << s.error().text;
  EXPECT_EQ(s->pose.position_m.x, 1);
  EXPECT_EQ(s->pose.position_m.z, -3);
  EXPECT_EQ(s->name, "rov");
  EXPECT_EQ(s->stamp.domain, ClockDomain::arrival);
  EXPECT_NEAR(rotate(s->pose.orientation, {1, 0, 0}).x, 1, 1e-12);
}

TEST(JsonPose, KeepsTheAnglesThatWereSent) {
  const auto largest = [](const std::string& orientation) {
    return angle_beyond_radians(parse_json_pose(R"({"position":[0,0,3],)" + orientation + "}")->sent_angles).rad;
  };
  EXPECT_EQ(largest(R"("attitude":[1,-90,45])"), 90);
  EXPECT_EQ(largest(R"("attitude":[0,-5,45])"), 45) << "a pitch of 5 rad is impossible";
  EXPECT_EQ(largest(R"("attitude":[0,1.5,-45])"), 0) << "a heading may be 7 turns";
  EXPECT_EQ(largest(R"("attitude":[0,1.5,-65])"), 65);
  EXPECT_EQ(largest(R"("quaternion":[1,0,0,0])"), 0);
}

TEST(JsonPose, RefusalsHaveAReason) {
  EXPECT_EQ(why("nonsense"), "line is not JSON");
  EXPECT_EQ(why(""), "line is not JSON");
  EXPECT_EQ(why("[1,2,3]"), "line is not a JSON object");
  EXPECT_EQ(why(R"({"attitude":[0,0,0]})"), "position is missing");
  EXPECT_THAT(why(R"({"position":[0,0,0]})"), HasSubstr("attitude [roll, pitch, yaw] or quaternion"));
  EXPECT_EQ(why(R"({"position":[0,0],"attitude":[0,0,0]})"), "position must be a list of 3 numbers");
  EXPECT_EQ(why(R"({"position":[0,0,"x"],"attitude":[0,0,0]})"), "position must be a list of 3 numbers");
  EXPECT_EQ(why(R"({"position":[0,0,null],"attitude":[0,0,0]})"), "position must be a list of 3 numbers");
  EXPECT_EQ(why(R"({"position":[0,0,NaN],"attitude":[0,0,0]})"), "line is not JSON");
  EXPECT_EQ(why(R"({"position":[0,0,1e999],"attitude":[0,0,0]})"), "line is not JSON");
  EXPECT_THAT(why(R"({"position":[0,0,1e200],"attitude":[0,0,0]})"), HasSubstr("1e8 m"));
  EXPECT_THAT(why(R"({"position":[0,0,0],"quaternion":[1,1,0,0]})"), HasSubstr("normalise"));
  EXPECT_EQ(why(R"({"position":[0,0,0],"quaternion":[1,0,0]})"), "quaternion must be a list of 4 numbers");
  EXPECT_THAT(why(R"({"position":[0,0,0],"attitude":[0,-1e308,0]})"), HasSubstr("above 1e6 rad"));
  EXPECT_THAT(why(R"({"position":[0,0,0],"attitude":[0,0,0],"frame":"NWU"})"), HasSubstr("NED_FRD"));
  EXPECT_EQ(why(R"({"position":[0,0,0],"attitude":[0,0,0],"vehicle":3})"), "vehicle must be a string");
  EXPECT_THAT(why(R"({"position":[0,0,0],"attitude":[0,0,0],"timestamp":"now"})"), HasSubstr("seconds"));
  EXPECT_THAT(why(R"({"position":[0,0,0],"attitude":[0,0,0],"timestamp":1e12})"), HasSubstr("4.5e9"));
  EXPECT_THAT(why(R"({"position":[0,0,0],"attitude":[0,0,0],"timestamp":-4.6e9})"), HasSubstr("4.5e9"));
  EXPECT_EQ(why(R"({"position":[0,0,0],"attitude":[0,0,0],"timestamp":4.5e9})"), "accepted");
  EXPECT_THAT(why(R"({"position":[0,0,0],"attitude":[0,0,0],"velocity":[1e9,0,0]})"), HasSubstr("velocity"));
  EXPECT_THAT(why(std::string(2000, '[')), HasSubstr("deeper"));
  EXPECT_THAT(why(std::string(5000, ' ')), HasSubstr("4096"));
  EXPECT_EQ(why("{\"position\":[0,0,0],\"attitude\":[0,0,0],\"vehicle\":\"\xff\xfe\"}"), "line is not JSON") << "invalid UTF-8";
}

TEST(JsonPose, EveryTruncationIsRefused) {
  const std::string line = R"({"timestamp":1.0,"position":[0,0,3],"attitude":[0,0.1,0.5],"velocity":[0,0,0]})";
  for (std::size_t n = 0; n < line.size(); ++n) ASSERT_NE(why(line.substr(0, n)), "accepted") << n;
  EXPECT_EQ(why(line), "accepted");
}

TEST(JsonPose, OnlyWholeObjectsAreAccepted) {
  EXPECT_TRUE(is_json_object("{}") && is_json_object(R"( {"frame":"NWU"})"));
  for (const std::string line : {"", "[]", "3", "{", "{\"a\":}", "POST / HTTP/1.1", "{} {}"})
    EXPECT_FALSE(is_json_object(line)) << line;
  EXPECT_FALSE(is_json_object("{" + std::string(2000, '[')));
}

std::span<const std::byte> bytes(const std::string& s) { return std::as_bytes(std::span(s.data(), s.size())); }

TEST(LineParser, EverySplitGivesTheSameLines) {
  const std::string stream = "one\ntwo\r\n\n  \nthree\n";
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    LineParser parser;
    std::vector<std::string> lines;
    for (const auto& part : {stream.substr(0, cut), stream.substr(cut)}) {
      parser.feed(bytes(part));
      while (auto line = parser.next()) lines.push_back(line->text);
    }
    ASSERT_EQ(lines, (std::vector<std::string>{"one", "two", "three"})) << "cut at " << cut;
  }
}

TEST(LineParser, AfterAGapTheNextWholeLineIsReturned) {
  const auto bytes = [](std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); };
  for (const bool has_whole_line : {false, true}) {
    LineParser parser;
    if (has_whole_line) parser.feed(bytes("{\"a\":1}\n"));
    parser.feed(bytes("{\"b\":"));
    parser.skip_gap();
    if (has_whole_line) {
      ASSERT_EQ(parser.next().value().text, "{\"a\":1}");
    }
    EXPECT_FALSE(parser.next());
    EXPECT_TRUE(parser.may_become_object()) << "the beginning of the line is not known";
    parser.feed(bytes("5,6"));
    EXPECT_FALSE(parser.next());
    parser.feed(bytes("]}\n{\"c\":3}\n{\"d"));
    EXPECT_EQ(parser.next().value().text, "{\"c\":3}");
    EXPECT_FALSE(parser.next());
  }
  LineParser skips;
  skips.feed(bytes(std::string(5000, 'x')));
  EXPECT_TRUE(skips.next().value().too_long);
  skips.skip_gap();
  skips.feed(bytes("x\n{}\n"));
  EXPECT_EQ(skips.next().value().text, "{}");
}

TEST(LineParser, ARequestLineIsDetectedBeforeItsEnd) {
  LineParser parser;
  EXPECT_TRUE(parser.may_become_object());
  parser.feed(bytes("{\"position\":[0,0,0]}\n  \r\n {\"pos"));
  EXPECT_TRUE(parser.next());
  EXPECT_FALSE(parser.next());
  EXPECT_TRUE(parser.may_become_object());
  parser.feed(bytes("\n PO"));
  EXPECT_TRUE(parser.next());
  EXPECT_FALSE(parser.next());
  EXPECT_FALSE(parser.may_become_object());
}

TEST(LineParser, AByteOrderMarkAtTheStartIsSkipped) {
  const std::string mark = "\xef\xbb\xbf", stream = mark + "{}\n" + mark + "{}\n";
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    LineParser parser;
    std::vector<std::string> lines;
    for (const auto& part : {stream.substr(0, cut), stream.substr(cut)}) {
      parser.feed(bytes(part));
      while (auto line = parser.next()) lines.push_back(line->text);
      if (lines.empty()) {
        EXPECT_TRUE(parser.may_become_object()) << cut;
      }
    }
    ASSERT_EQ(lines, (std::vector<std::string>{"{}", mark + "{}"})) << "cut at " << cut;
  }
}

TEST(LineParser, DetectsLinesThatBeginLikeAnObject) {
  const auto begins = [](const std::string& line) {
    LineParser parser;
    parser.feed(bytes(line));
    const auto first = parser.next();
    return first && first->begins_object;
  };
  const std::string longest(5000, 'x');
  EXPECT_TRUE(begins("{\n") && begins(" \t{NaN}\n") && begins("{" + longest) && begins("{" + longest + "\n"));
  EXPECT_FALSE(begins("POST / HTTP/1.1\n") || begins("[{}]\n") || begins(longest) || begins(longest + "\n"));
}

TEST(LineParser, TheTimeOfManyLinesGrowsInProportion) {
  // 32 MiB of two-byte lines: moving the rest forward after each line would copy 280 TB, which takes hours. Under sanitizers an
  // eighth of the size is used: 4 TB.
  constexpr int many = test::is_sanitized ? 2 << 20 : 16 << 20;
  std::string stream;
  for (int i = 0; i < many; ++i) stream += "x\n";
  LineParser parser;
  parser.feed(bytes(stream));
  int lines = 0;
  while (parser.next()) ++lines;
  EXPECT_EQ(lines, many);
  parser.feed(bytes("last\n"));
  EXPECT_EQ(parser.next()->text, "last");
}

TEST(LineParser, ALineBeyondTheLimitIsReportedOnceAndSkipped) {
  LineParser parser;
  int too_long = 0;
  std::vector<std::string> lines;
  const auto drain = [&] {
    while (auto line = parser.next()) line->too_long ? void(++too_long) : lines.push_back(line->text);
  };
  for (int i = 0; i < 100; ++i) {
    parser.feed(bytes(std::string(1000, 'x')));
    drain();
  }
  parser.feed(bytes("tail\ngood\n"));
  drain();
  EXPECT_EQ(too_long, 1);
  EXPECT_EQ(lines, (std::vector<std::string>{"good"}));
}

}  // namespace
}  // namespace sonar::control
