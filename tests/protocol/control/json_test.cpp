// Tests the messages as JSON: input must be checked strictly, and output must be valid JSON with the names of control.proto.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/protocol/control/examples.hpp"

namespace sonar::control {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string refusal_of(std::string_view op, std::string_view text) {
  const auto request = request_from_json(op, text);
  return request ? "accepted" : request.error().text;
}

TEST(ControlJson, ReadsBothSpellingsOfNames) {
  for (const char* text : {R"({"sonar":"front","range_m":5,"rate_hz":0,"transmit":false})",
                           R"({"sonar":"front","rangeM":5.0,"rateHz":"0","transmit":false})"}) {
    const auto request = request_from_json("sonar", text);
    ASSERT_TRUE(request) << request.error().text;
    const auto& set = std::get<SetSonar>(request->op);
    EXPECT_EQ(set.range_m, 5.0);
    EXPECT_EQ(set.rate_hz, 0.0);
    EXPECT_EQ(set.transmit, false);
    EXPECT_FALSE(set.gain_percent);
  }
}

TEST(ControlJson, ReadsEveryRequestLikeItsBytes) {
  const auto pose = request_from_json(
      "pose",
      R"({"vehicle":"rov","seq":"3","time":{"domain":"SIM","ns":"123456789"},"frame":"ENU_FLU","position":{"x":1,"y":2,"z":-3},
          "orientation":{"w":1},"twist":{"linear":{"x":0.5}}})");
  ASSERT_TRUE(pose) << pose.error().text;
  EXPECT_EQ(std::get<PoseSample>(pose->op).pose.position_m.y, 2);
  EXPECT_EQ(std::get<PoseSample>(pose->op).stamp.ns, 123456789);
  const std::string at = R"("at":{"frame":"NED_FRD","position":{"x":1,"y":2,"z":3},"orientation":{"w":1}})";
  const auto add = request_from_json("add_object", R"({"name":"a","like":"b",)" + at + "}");
  ASSERT_TRUE(add) << add.error().text;
  EXPECT_EQ(std::get<AddObject>(add->op).in_world.position_m.x, 2) << "north and east are exchanged";
  const auto plays = request_from_json("set_trajectory", R"({"vehicle":"rov","paused":true,"speed":2})");
  ASSERT_TRUE(plays) << plays.error().text;
  EXPECT_EQ(std::get<SetTrajectory>(plays->op).speed, 2.0);
  EXPECT_THAT(request_from_json("set_trajectory", R"({"vehicle":"a","object":"b"})").error().text, HasSubstr("not both"));
  const auto set = request_from_json("set_object", R"({"object":"a","visible":false})");
  ASSERT_TRUE(set);
  EXPECT_EQ(std::get<SetObject>(set->op).visible, false);
  EXPECT_TRUE(request_from_json("status", "{}"));
  EXPECT_TRUE(request_from_json("load", R"({"path":"demo.yaml"})"));
  EXPECT_TRUE(request_from_json("remove_object", R"({"object":"a"})"));
  EXPECT_TRUE(request_from_json("environment", R"({"environment":{"temperature_c":4}})"));
  EXPECT_TRUE(request_from_json("subscribe", R"({"pings":true})"));
  EXPECT_TRUE(request_from_json("object", R"({"object":"a",)" + at.substr(6)));
}

TEST(ControlJson, RefusalsHaveAReason) {
  EXPECT_THAT(refusal_of("sonar", R"({"rang_m":5})"), HasSubstr("\"rang_m\": unknown key"));
  EXPECT_THAT(refusal_of("sonar", R"({"range_m":"NaN"})"), HasSubstr("sonar.range_m is NaN"));
  EXPECT_THAT(refusal_of("sonar", R"({"range_m":1e999})"), HasSubstr("not JSON"));
  EXPECT_THAT(refusal_of("sonar", R"({"mode":-1})"), HasSubstr("-1"));
  EXPECT_THAT(refusal_of("sonar", R"({"range_m":5,"range_m":6})"), HasSubstr("\"range_m\" is given twice"));
  EXPECT_THAT(refusal_of("sonar", R"({"range_m":5,"rangeM":6})"), HasSubstr("\"rangeM\" is given twice"));
  EXPECT_THAT(refusal_of("sonar", R"({"rangeM":5,"range_m":6})"), HasSubstr("\"range_m\" is given twice"));
  EXPECT_THAT(refusal_of("sonar", R"({range_m:5})"), HasSubstr("not JSON"));
  EXPECT_THAT(refusal_of("sonar", R"({"range_m":5,})"), HasSubstr("not JSON"));
  EXPECT_THAT(refusal_of("sonar", R"({"range_m":5} {"range_m":6})"), HasSubstr("not JSON"));
  EXPECT_THAT(refusal_of("sonar", "{\"sonar\":\"\xff\"}"), HasSubstr("not JSON"));
  EXPECT_EQ(refusal_of("sonar", std::string("{}\0\n{", 5)), "not JSON: a zero byte at character 3");
  EXPECT_THAT(refusal_of("sonar", "[]"), HasSubstr("not a JSON object"));
  EXPECT_THAT(refusal_of("sonar", ""), HasSubstr("not JSON"));
  EXPECT_THAT(refusal_of("sonar", std::string(100000, '[')), HasSubstr("nested deeper than 16"));
  std::string many = "[";
  for (int i = 0; i < 300000; ++i) many += "{},";
  EXPECT_THAT(refusal_of("sonar", many + "{}]"), HasSubstr("more than 4096 values"));
  EXPECT_THAT(refusal_of("sonar", std::string(largest_json + 1, ' ')), HasSubstr("1 MiB"));
  EXPECT_THAT(refusal_of("pose", R"({"position":{"x":1},"orientation":{"w":1}})"), HasSubstr("frame is missing"));
  EXPECT_THAT(refusal_of("pose", R"({"frame":"SIDEWAYS","position":{},"orientation":{"w":1}})"), HasSubstr("SIDEWAYS"));
  EXPECT_THAT(refusal_of("load", "{}"), HasSubstr("path is missing"));
  EXPECT_EQ(refusal_of("id", "{}"), "unknown request");
  EXPECT_EQ(refusal_of("launch", "{}"), "unknown request");
}

TEST(ControlJson, NamesTheMistake) {
  const std::string whole = "a whole number from 0 to ", few = "4294967295", many = "18446744073709551615";
  const struct {
    const char *op, *text;
    std::string why;
  } mistakes[]{
      {"sonar", R"({"rang_m":5})", R"("rang_m": unknown key)"},
      {"sonar", R"({"range_M":5})", R"("range_M": unknown key)"},
      {"sonar", R"({"mount":{"frame":"FRD","xyz_m":[0,0,0]}})", R"("mount.xyz_m": unknown key)"},
      {"sonar", R"({"two\nlines":5})", R"("two\nlines": unknown key)"},
      {"sonar", R"({"range_m":"far"})", R"("range_m": invalid value "far", expected a number)"},
      {"sonar", R"({"rangeM":true})", R"("rangeM": invalid value true, expected a number)"},
      {"sonar", R"({"mode":-3})", R"("mode": invalid value -3, expected )" + whole + few},
      {"sonar", R"({"mode":0.5})", R"("mode": invalid value 0.5, expected )" + whole + few},
      {"sonar", R"({"mode":"4294967296"})", R"("mode": invalid value "4294967296", expected )" + whole + few},
      {"sonar", R"({"transmit":7})", R"("transmit": invalid value 7, expected true or false)"},
      {"sonar", R"({"sonar":7})", R"("sonar": invalid value 7, expected a text in quotes)"},
      {"sonar", R"({"mount":3})", R"("mount": invalid value 3, expected an object {...})"},
      {"sonar", R"({"mount":{"position":{"x":"far"}}})", R"("mount.position.x": invalid value "far", expected a number)"},
      {"sonar", R"({"mount":{"frame":"XYZ"}})", R"("mount.frame": invalid value "XYZ", expected )"},
      {"pose", R"({"seq":1e30})", R"("seq": invalid value 1e+30, expected )" + whole + many},
      {"pose", R"({"seq":null,"time":{"domain":[]}})", R"("time.domain": invalid value [], expected )"},
  };
  for (const auto& mistake : mistakes) EXPECT_THAT(refusal_of(mistake.op, mistake.text), testing::StartsWith(mistake.why));
}

TEST(ControlJson, TheNameMayBeInThePath) {
  const auto sonar = request_from_json("sonar", R"({"range_m":5})", "front");
  ASSERT_TRUE(sonar) << sonar.error().text;
  EXPECT_EQ(std::get<SetSonar>(sonar->op).sonar, "front");
  EXPECT_EQ(std::get<SetObject>(request_from_json("set_object", R"({"object":"crate"})", "crate")->op).object, "crate");
  const auto two = request_from_json("set_object", R"({"object":"crate"})", "wreck");
  ASSERT_FALSE(two);
  EXPECT_THAT(two.error().text, HasSubstr("names another"));
  EXPECT_THAT(request_from_json("set_object", "{}", "a\nb").error().text, HasSubstr("control characters"));
}

TEST(ControlJson, TruncationsAreRefusedWithoutALineOnStderr) {
  const std::string whole = R"({"name":"a","like":"b","at":{"frame":"NED_FRD","position":{"x":1},"orientation":{"w":1}}})";
  testing::internal::CaptureStderr();
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const auto request = request_from_json("add_object", std::string_view(whole).substr(0, n));
    ASSERT_FALSE(request) << n;
    EXPECT_FALSE(request.error().text.empty());
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_TRUE(request_from_json("add_object", whole));
}

TEST(ControlJson, WritesTheNamesOfTheProtoAndNumbersThatAreZero) {
  const json status = json::parse(json_of(full_status()));
  EXPECT_EQ(status["seed"], "18446744073709551615");
  EXPECT_EQ(status["sonars"][0]["range_m"], 10.0);
  EXPECT_EQ(status["sonars"][0]["figures"]["late_ms_p99"], 11.5);
  EXPECT_EQ(status["sonars"][0]["transmits"], false);
  EXPECT_EQ(status["environment"]["sound_speed_mps"], 0.0);
  EXPECT_EQ(status["vehicles"][0]["position"]["y"], -2.25);
  EXPECT_TRUE(json::parse(json_of(v1::DaemonStatus()))["sonars"].empty());
  const json answer = json::parse(json_of(response_of(7, StatusCode::refused, "no \"such\" sonar")));
  EXPECT_EQ(answer["id"], "7");
  EXPECT_EQ(answer["status"]["code"], "REFUSED");
  EXPECT_EQ(answer["status"]["text"], "no \"such\" sonar");
  EXPECT_EQ(json_of(StatusCode::ok, ""), R"({"code":"OK","text":""})");
  for (const v1::Event& event : every_event()) {
    const std::string text = json_of(event);
    EXPECT_EQ(text.find('\n'), std::string::npos);
    EXPECT_TRUE(json::parse(text).contains("unsent"));
  }
  EXPECT_EQ(json::parse(json_of(every_event()[0]))["ping"]["number"], 7);
}

}  // namespace
}  // namespace sonar::control
