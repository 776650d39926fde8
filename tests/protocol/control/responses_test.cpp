// Tests answers and events in both directions. A client must check messages as strictly as the daemon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/protocol/control/examples.hpp"

namespace sonar::control {
namespace {

using testing::HasSubstr;

v1::Response response_with(std::uint64_t id, const v1::DaemonStatus& status) {
  v1::Response response = response_of(id, StatusCode::ok);
  *response.mutable_daemon() = status;
  return response;
}
v1::Response response_with(const v1::Event& event) {
  v1::Response response = response_of(0, StatusCode::ok);
  *response.mutable_event() = event;
  return response;
}

TEST(ControlResponses, AStatusArrivesWhole) {
  const v1::Response sent = response_with(5, full_status());
  const auto got = decode_response(encode_response(sent));
  ASSERT_TRUE(got) << got.error().text;
  EXPECT_TRUE(same(**got, sent)) << json_of(**got);
  const Pose seen = pose_of((*got)->daemon().sonars(0));
  EXPECT_EQ(seen.position_m.y, -2.25);
  EXPECT_EQ(seen.orientation.y, 0.8);
}

TEST(ControlResponses, AnOrientationThatIsNotGivenIsLevel) {
  const Pose level = pose_of(v1::SonarStatus());
  EXPECT_EQ(level.orientation.w, 1);
  EXPECT_EQ(level.orientation.x, 0);
}

TEST(ControlResponses, AStepIsReadAsJson) {
  v1::Stepped stepped;
  stepped.set_now_ns(1234567890123456789);
  stepped.set_pings(3);
  EXPECT_EQ(json_of(stepped), R"({"now_ns":"1234567890123456789","pings":"3"})");
}

TEST(ControlResponses, EveryEventArrivesWhole) {
  for (const v1::Event& event : every_event()) {
    const v1::Response sent = response_with(event);
    const auto got = decode_response(encode_response(sent));
    ASSERT_TRUE(got) << got.error().text;
    EXPECT_TRUE(same(**got, sent)) << json_of(**got);
  }
  EXPECT_FALSE(decode_response(encode_response(response_with(v1::Event())))) << "an event of a later version";
}

TEST(ControlResponses, EveryCodeArrives) {
  for (const auto& [code, number] :
       {std::pair{StatusCode::ok, v1::Status::OK}, std::pair{StatusCode::refused, v1::Status::REFUSED},
        std::pair{StatusCode::unsupported, v1::Status::UNSUPPORTED}, std::pair{StatusCode::failed, v1::Status::FAILED},
        std::pair{StatusCode::unauthenticated, v1::Status::UNAUTHENTICATED}}) {
    const auto got = decode_response(encode_response(response_of(1, code, "why")));
    ASSERT_TRUE(got);
    EXPECT_EQ((*got)->status().code(), number);
    EXPECT_EQ((*got)->status().text(), "why");
  }
}

TEST(ControlResponses, TextsThatAreNotUtf8AreRepaired) {
  testing::internal::CaptureStderr();
  const std::string broken = "caf\xe9 \xf0\x9f\x90\x9f \xed\xa0\x80";  // Latin-1, a fish, half a surrogate
  const auto got = decode_response(encode_response(response_of(1, StatusCode::failed, broken)));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_TRUE(got) << got.error().text;
  EXPECT_EQ((*got)->status().text(), "caf? \xf0\x9f\x90\x9f ???");
}

TEST(ControlResponses, TheClientRefusesInvalidNumbers) {
  v1::DaemonStatus status = full_status();
  status.mutable_sonars(0)->mutable_position()->set_y(std::numeric_limits<double>::quiet_NaN());
  const auto unreal = decode_response(encode_response(response_with(1, status)));
  ASSERT_FALSE(unreal);
  EXPECT_EQ(unreal.error().text, "daemon.sonars[0].position.y is NaN or infinite");
  status = full_status();
  status.mutable_objects(0)->mutable_orientation()->set_w(3);
  const auto stretched = decode_response(encode_response(response_with(1, status)));
  ASSERT_FALSE(stretched);
  EXPECT_EQ(stretched.error().text, "daemon.objects[0].orientation is not a quaternion of norm 1");
}

TEST(ControlResponses, TruncationsAreReadOrRefusedNeverFatal) {
  std::vector<Bytes> wholes = {encode_response(response_with(5, full_status()))};
  for (const v1::Event& event : every_event()) wholes.push_back(encode_response(response_with(event)));
  int refused = 0;
  for (const Bytes& whole : wholes) {
    for (std::size_t n = 0; n < whole.size(); ++n) {
      const auto got = decode_response(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)));
      if (got) {
        EXPECT_TRUE(decode_response(encode_response(**got)));
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
