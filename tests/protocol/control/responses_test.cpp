// Answers and events in both directions; a client is no more trusting than the daemon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/protocol/control/examples.hpp"

namespace sonar::control {
namespace {

using testing::HasSubstr;

TEST(ControlResponses, AStatusArrivesWhole) {
  const Response sent{5, StatusCode::ok, "", false, full_status()};
  const auto got = decode_response(encode_response(sent));
  ASSERT_TRUE(got) << got.error().text;
  EXPECT_TRUE(same(*got, sent)) << json_of(*got);
  const auto& status = std::get<DaemonStatus>(got->body);
  EXPECT_EQ(status.seed, 0xffff'ffff'ffff'ffff);
  EXPECT_EQ(status.sonars.at(0).clients.at(1).pings_dropped, 6u);
  EXPECT_EQ(status.sonars.at(0).figures.late_ms_p99, 11.5);
  EXPECT_EQ(status.sonars.at(0).status_to.at(1), "10.0.0.7:52102");
  EXPECT_FALSE(status.sonars.at(0).transmits);
  EXPECT_EQ(status.vehicles.at(0).source, "demo orbit");
  EXPECT_FALSE(status.vehicles.at(0).trajectory);
  ASSERT_TRUE(status.vehicles.at(1).trajectory);
  EXPECT_EQ(status.vehicles.at(1).trajectory->file, "dive.tum");
  EXPECT_EQ(status.vehicles.at(1).trajectory->position_s, 1.5);
  EXPECT_TRUE(status.vehicles.at(1).trajectory->paused && status.vehicles.at(1).trajectory->loop);
  EXPECT_FALSE(status.objects.at(0).visible);
  EXPECT_EQ(status.poses.over_rate, 25u);
  EXPECT_EQ(status.environment.sound_speed_mps, 0.0);
  EXPECT_EQ(status.now_ns, 1234567890123456780);
  EXPECT_EQ(status.notes.at(0).vehicle, "rov");
  EXPECT_EQ(status.notes.at(1).text, "wreck is 1200 m long");
  EXPECT_EQ(status.notes.at(1).cure, "set scale");
}

TEST(ControlResponses, AStepArrivesWhole) {
  const Response sent{6, StatusCode::ok, "", false, Stepped{1234567890123456789, 3}};
  const auto got = decode_response(encode_response(sent));
  ASSERT_TRUE(got) << got.error().text;
  EXPECT_TRUE(same(*got, sent)) << json_of(*got);
  EXPECT_EQ(json_of(std::get<Stepped>(got->body)), R"({"now_ns":"1234567890123456789","pings":"3"})");
}

TEST(ControlResponses, EveryEventArrivesWhole) {
  for (const Event& event : every_event()) {
    const Response sent{0, StatusCode::ok, "", false, event};
    const auto got = decode_response(encode_response(sent));
    ASSERT_TRUE(got) << got.error().text;
    EXPECT_TRUE(same(*got, sent)) << json_of(*got);
    EXPECT_EQ(std::get<Event>(got->body).what.index(), event.what.index());
    EXPECT_EQ(std::get<Event>(got->body).unsent, event.unsent);
  }
}

TEST(ControlResponses, EveryCodeArrives) {
  for (const StatusCode code : {StatusCode::ok, StatusCode::refused, StatusCode::unsupported, StatusCode::failed}) {
    const auto got = decode_response(encode_response({1, code, "why", false}));
    ASSERT_TRUE(got);
    EXPECT_EQ(got->code, code);
    EXPECT_EQ(got->text, "why");
  }
}

TEST(ControlResponses, TextsThatAreNoUtf8AreRepairedNotLost) {
  testing::internal::CaptureStderr();
  const std::string broken = "caf\xe9 \xf0\x9f\x90\x9f \xed\xa0\x80";  // Latin-1, a fish, half a surrogate
  const auto got = decode_response(encode_response({1, StatusCode::failed, broken, false}));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_TRUE(got) << got.error().text;
  EXPECT_EQ(got->text, "caf? \xf0\x9f\x90\x9f ???");
}

TEST(ControlResponses, NumbersThatAreNoneAreRefusedByTheClient) {
  DaemonStatus status = full_status();
  status.sonars[0].in_world.position_m.y = std::numeric_limits<double>::quiet_NaN();
  const auto unreal = decode_response(encode_response({1, StatusCode::ok, "", false, status}));
  ASSERT_FALSE(unreal);
  EXPECT_EQ(unreal.error().text, "daemon.sonars[0].position.y is NaN or infinite");
  status = full_status();
  status.objects[0].in_world.orientation = {3, 0, 0, 0};
  const auto stretched = decode_response(encode_response({1, StatusCode::ok, "", false, status}));
  ASSERT_FALSE(stretched);
  EXPECT_EQ(stretched.error().text, "daemon.objects[0].orientation is not a quaternion of norm 1");
}

TEST(ControlResponses, TruncationsAreReadOrRefusedNeverFatal) {
  std::vector<Bytes> wholes = {encode_response({5, StatusCode::ok, "", false, full_status()})};
  for (const Event& event : every_event()) wholes.push_back(encode_response({0, StatusCode::ok, "", false, event}));
  int refused = 0;
  for (const Bytes& whole : wholes) {
    for (std::size_t n = 0; n < whole.size(); ++n) {
      const auto got = decode_response(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)));
      if (got) {
        EXPECT_TRUE(decode_response(encode_response(*got)));
        continue;
      }
      ++refused;
      EXPECT_FALSE(got.error().text.empty());
    }
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace sonar::control
