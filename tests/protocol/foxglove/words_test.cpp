// Tests JSON messages: those of the protocol's examples, and messages of viewers that are refused.
#include "protocol/foxglove/foxglove_words.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace sonar::foxglove {
namespace {

using nlohmann::json;
using nlohmann::literals::operator""_json;
using ::testing::HasSubstr;

TEST(FoxgloveWords, MessagesForViewersAreWritten) {
  ServerInfo info{"sonard 0.2.0", {"parameters", "time"}, {{"sonard.clock", "stepped"}}, "17-1", std::nullopt};
  EXPECT_EQ(json::parse(text_of(info)), R"({"op": "serverInfo", "name": "sonard 0.2.0", "capabilities": ["parameters", "time"],
    "supportedEncodings": ["json"], "metadata": {"sonard.clock": "stepped"}, "sessionId": "17-1"})"_json);
  info.data = {Time{}, Time(std::chrono::milliseconds(90250))};
  EXPECT_EQ(json::parse(text_of(info))["dataEndTime"], R"({"sec": 90, "nsec": 250000000})"_json);

  const std::vector<Channel> channels{{1, "/front/image", "protobuf", {"foxglove.RawImage", "protobuf", "Zg=="}}};
  EXPECT_EQ(json::parse(advertise(channels)), R"({"op": "advertise", "channels": [{"id": 1, "topic": "/front/image",
    "encoding": "protobuf", "schemaName": "foxglove.RawImage", "schema": "Zg==", "schemaEncoding": "protobuf"}]})"_json);
  EXPECT_EQ(json::parse(unadvertise(std::vector<std::uint32_t>{1, 2})), R"({"op": "unadvertise", "channelIds": [1, 2]})"_json);
  EXPECT_EQ(json::parse(status(StatusLevel::warning, "Send buffer limit reached", "slow")),
            R"({"op": "status", "level": 1, "message": "Send buffer limit reached", "id": "slow"})"_json);
  EXPECT_EQ(json::parse(remove_status("slow")), R"({"op": "removeStatus", "statusIds": ["slow"]})"_json);
  const std::vector<Parameter> parameters{
      {"/a", 10.0}, {"/b", std::int64_t{1}}, {"/c", true}, {"/d", std::string("x")}, {"/e", std::monostate{}}};
  EXPECT_EQ(json::parse(parameter_values(parameters, "7")), R"({"op": "parameterValues", "id": "7", "parameters": [
    {"name": "/a", "value": 10.0, "type": "float64"}, {"name": "/b", "value": 1}, {"name": "/c", "value": true},
    {"name": "/d", "value": "x"}, {"name": "/e"}]})"_json);
  EXPECT_EQ(json::parse(service_failure(1, 2, "no")),
            R"({"op": "serviceCallFailure", "serviceId": 1, "callId": 2, "message": "no"})"_json);
  const json services = json::parse(advertise_services(std::vector<Service>{{1, "/sonard/step", "sonar.v1.Step"}}));
  EXPECT_EQ(services["services"][0]["request"]["schema"], R"({"type":"object"})");
  EXPECT_EQ(services["services"][0]["request"]["encoding"], "json");
}

TEST(FoxgloveWords, MessagesOfViewersAreRead) {
  const auto subscribe =
      word_of_viewer(R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 10}, {"id": 4294967295, "channelId": 2}]})");
  ASSERT_TRUE(subscribe);
  EXPECT_EQ(std::get<Subscribe>(*subscribe).subscriptions.at(1), std::pair(4294967295u, 2u));
  EXPECT_EQ(std::get<Unsubscribe>(*word_of_viewer(R"({"op": "unsubscribe", "subscriptionIds": [1]})")).subscriptions.at(0), 1u);
  const auto get = word_of_viewer(R"({"op": "getParameters", "parameterNames": [], "id": "get-all-params"})");
  EXPECT_EQ(std::get<GetParameters>(*get).request, "get-all-params");
  const auto set = word_of_viewer(R"({"op": "setParameters", "parameters": [{"name": "/r", "value": 5, "type": "float64"},
    {"name": "/m", "value": 1}, {"name": "/u"}, {"name": "/l", "value": [1]}, {"name": "/f", "value": 1.5}]})");
  ASSERT_TRUE(set);
  const auto& p = std::get<SetParameters>(*set).parameters;
  EXPECT_EQ(p[0].value, Value(5.0));
  EXPECT_EQ(p[1].value, Value(std::int64_t{1}));
  EXPECT_EQ(p[2].value, Value(std::monostate{}));
  EXPECT_EQ(p[3].value, Value(OtherValue{}));
  EXPECT_EQ(p[4].value, Value(1.5));
  EXPECT_TRUE(std::get<WatchParameters>(*word_of_viewer(R"({"op": "subscribeParameterUpdates", "parameterNames": ["/a"]})")).on);
  EXPECT_EQ(std::get<Incapable>(*word_of_viewer(R"({"op": "fetchAsset", "uri": "x", "requestId": 1})")).capability, "assets");
  EXPECT_EQ(std::get<UnknownWord>(*word_of_viewer(R"({"op": "dance"})")).op, "dance");
}

TEST(FoxgloveWords, StrayFieldsAreNamed) {
  const auto stray = [](std::string_view text) {
    std::string name = "?";
    EXPECT_TRUE(word_of_viewer(text, &name)) << text;
    return name;
  };
  EXPECT_EQ(stray(R"({"op": "setParameters", "id": "1", "parameters": [{"name": "/r", "value": 5, "type": "float64"}]})"), "");
  EXPECT_EQ(stray(R"({"op": "setParameters", "parameters": [{"name": "/r", "value": 5, "unit": "m"}]})"), "unit");
  EXPECT_EQ(stray(R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 2}, {"id": 2, "channelId": 3, "rate": 1}]})"),
            "rate");
  EXPECT_EQ(stray(R"({"op": "unsubscribe", "subscriptionIds": [1], "why": 0})"), "why");
}

TEST(FoxgloveWords, WrongMessagesAreRefused) {
  const auto refusal = [](std::string_view text) {
    const auto word = word_of_viewer(text);
    return word ? std::string("accepted") : word.error().text;
  };
  EXPECT_THAT(refusal("{"), HasSubstr("not a JSON object"));
  EXPECT_THAT(refusal("[1]"), HasSubstr("not a JSON object"));
  EXPECT_THAT(refusal("{}"), HasSubstr("\"op\""));
  EXPECT_THAT(refusal(R"({"op": 1})"), HasSubstr("\"op\""));
  EXPECT_THAT(refusal(R"({"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 1}]})"), HasSubstr("32-bit"));
  EXPECT_THAT(refusal(R"({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]})"), HasSubstr("32-bit"));
  EXPECT_THAT(refusal(R"({"op": "subscribe", "subscriptions": {}})"), HasSubstr("list"));
  EXPECT_THAT(refusal(R"({"op": "getParameters"})"), HasSubstr("parameterNames"));
  EXPECT_THAT(refusal(R"({"op": "getParameters", "parameterNames": [], "id": 1})"), HasSubstr("id must be a string"));
  EXPECT_THAT(refusal(std::string(17, '[')), HasSubstr("deeper"));
  std::string many = R"({"op": "getParameters", "parameterNames": [""])";
  many.insert(many.size() - 1, std::string(3 * 64, ' '));
  for (int i = 0; i < 64; ++i) many.replace(many.size() - 1, 1, ", \"\"]");
  EXPECT_THAT(refusal(many + "}"), HasSubstr("64 parameters"));
}

}  // namespace
}  // namespace sonar::foxglove
