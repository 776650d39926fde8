// A viewer in virtual time: its allowed requests, the order of its messages, and the messages that a slow viewer loses.
#include "daemon/emulator/view/viewer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>
#include <nlohmann/json.hpp>

namespace sonar {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using Kind = ViewChannel::Kind;

struct FakeHost final : ViewerHost {
  std::map<std::uint32_t, ViewChannel> channels{{1, {{1, "/image", "protobuf", {}}, Kind::picture, 0}},
                                                {2, {{2, "/geometry", "protobuf", {}}, Kind::last_value, 0}},
                                                {3, {{3, "/log", "protobuf", {}}, Kind::event, 0}},
                                                {4, {{4, "/fan", "protobuf", {}}, Kind::picture, 10}},
                                                {5, {{5, "/scene", "protobuf", {}}, Kind::last_value, 0}}};
  const ViewChannel* channel(std::uint32_t id) const override { return channels.contains(id) ? &channels.at(id) : nullptr; }
  void on_subscribed(Viewer&, std::uint32_t channel) override { subscribed.push_back(channel); }
  std::vector<foxglove::Parameter> parameters(const Viewer&, const std::vector<std::string>& names) override {
    std::vector<foxglove::Parameter> known;
    for (const auto& [name, value] : values)
      if (names.empty() || std::find(names.begin(), names.end(), name) != names.end()) known.push_back({name, value});
    return known;
  }
  std::string set_parameter(Viewer&, const foxglove::Parameter& wanted) override {
    if (!values.contains(wanted.name)) return "there is no such parameter";
    values[wanted.name] = wanted.value;
    return "";
  }
  bool steer_playback(Viewer& viewer, const foxglove::PlaybackControl& asked) override {
    if (viewer.playback().empty()) return false;
    playback.push_back(asked);
    return true;
  }
  void call(Viewer&, const foxglove::ServiceCall& call) override { calls.push_back(call); }

  std::map<std::string, foxglove::Value> values{{"/front/range_m", 10.0}};
  std::vector<std::uint32_t> subscribed;
  std::vector<foxglove::ServiceCall> calls;
  std::vector<foxglove::PlaybackControl> playback;
};

struct OneViewer : testing::Test {
  FakeHost host;
  Viewer viewer{host, {true, 0}, "127.0.0.1"};
  Viewer::Moment now{seconds(100)};

  void say(const std::string& text) { viewer.on_text(text, now); }
  void subscribe(std::uint32_t channel) {
    say(R"({"op": "subscribe", "subscriptions": [{"id": )" + std::to_string(100 + channel) + R"(, "channelId": )" +
        std::to_string(channel) + "}]}");
  }
  void offer(std::uint32_t channel, char what, const std::string& key = "", bool merges = false) {
    const auto bytes = std::make_shared<wire::Bytes>(1, static_cast<std::byte>(what));
    viewer.offer(channel, std::make_shared<ViewPayload>(ViewPayload{Time(seconds(1)), {{key, bytes}}, merges}), now);
  }
  static std::string text_of(const ViewMessage& message) {
    std::string text;
    for (const std::byte b : message.head) text += static_cast<char>(b);
    return text;
  }
  json next_word() {
    const auto message = viewer.next(now);
    return message && message->is_text ? json::parse(text_of(*message)) : json();
  }
  /// Takes all waiting messages; returns the first byte of each of their pieces.
  std::string rest() {
    std::string letters;
    while (const auto message = viewer.next(now))
      for (const ViewBytes& piece : message->pieces) letters += static_cast<char>(piece->front());
    return letters;
  }
};

TEST_F(OneViewer, GetsMessagesOfSubscribedChannelsOnly) {
  subscribe(1);
  EXPECT_THAT(host.subscribed, ElementsAre(1));
  offer(1, 'a');
  offer(2, 'x');  // not subscribed
  const auto message = viewer.next(now);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->head, foxglove::message_head(101, Time(seconds(1))));
  EXPECT_EQ(rest(), "");
  say(R"({"op": "unsubscribe", "subscriptionIds": [101]})");
  offer(1, 'b');
  EXPECT_EQ(rest(), "");
}

TEST_F(OneViewer, WrongSubscriptionsAreReported) {
  subscribe(9);
  EXPECT_EQ(next_word()["level"], 2);
  subscribe(1);
  subscribe(1);
  EXPECT_EQ(next_word()["level"], 1);
  say(R"({"op": "unsubscribe", "subscriptionIds": [7]})");
  EXPECT_EQ(next_word()["level"], 1);
  say(R"({"op": "fetchAsset"})");
  EXPECT_EQ(next_word()["message"], "fetchAsset needs the capability assets, which sonard does not have");
  say(R"({"op": "dance"})");
  EXPECT_EQ(next_word()["level"], 1);
  say(R"({"op": "dance"})");
  EXPECT_EQ(next_word(), json()) << "once";
  viewer.on_binary(wire::Bytes(1, std::byte{1}), now);
  EXPECT_EQ(next_word()["level"], 2);
}

TEST_F(OneViewer, TextsAreSentBeforeValuesAndPictures) {
  for (const std::uint32_t channel : {1u, 2u, 3u}) subscribe(channel);
  offer(1, 'p');
  offer(3, 'e');
  offer(2, 'g');
  say(R"({"op": "getParameters", "parameterNames": [], "id": "x"})");
  EXPECT_EQ(next_word()["parameters"][0]["value"], 10.0);
  EXPECT_EQ(rest().front(), 'g');
}

TEST_F(OneViewer, TheNewestPicturesAreSentAndLossesReported) {
  subscribe(1);
  subscribe(3);
  offer(1, 'a');
  offer(1, 'b');
  for (int i = 0; i < 70; ++i) offer(3, static_cast<char>('!' + i));
  const json status = next_word();
  EXPECT_EQ(status["message"], "Send buffer limit reached");
  EXPECT_EQ(status["id"], "slow");
  EXPECT_EQ(viewer.dropped().at(1), 1u);
  EXPECT_EQ(viewer.dropped().at(3), 6u);
  const std::string sent = rest();
  EXPECT_EQ(sent.size(), 65u);
  EXPECT_NE(sent.find('b'), std::string::npos);
  EXPECT_EQ(sent.find('!'), std::string::npos);
  EXPECT_EQ(*viewer.next_due(now), now + seconds(5));
  now += seconds(5);
  EXPECT_EQ(next_word()["op"], "removeStatus");
}

TEST_F(OneViewer, PicturesWithheldForARateAreNotCountedAsLost) {
  subscribe(4);
  for (const char c : {'a', 'b', 'c'}) {
    offer(4, c);
    if (c == 'a') {
      EXPECT_EQ(rest(), "a");
    }
  }
  EXPECT_EQ(rest(), "");
  EXPECT_EQ(*viewer.next_due(now), now + milliseconds(100));
  now += milliseconds(100);
  EXPECT_EQ(rest(), "c") << "the last picture is always sent";
  EXPECT_EQ(viewer.dropped().at(4), 0u);
}

TEST_F(OneViewer, ScenesMergeByEntity) {
  subscribe(5);
  offer(5, 'a', "crate", true);
  offer(5, 'b', "wreck", true);
  offer(5, 'c', "crate", true);
  const std::string sent = rest();
  EXPECT_EQ(sent, "cb");
}

TEST_F(OneViewer, SetsParametersAndGetsTheValuesThatHold) {
  say(R"({"op": "setParameters", "id": "1", "parameters": [{"name": "/front/range_m", "value": 5.5}, {"name": "/nothing", "value": 1}]})");
  const json refusal = next_word(), answer = next_word();
  EXPECT_EQ(refusal["level"], 2);
  EXPECT_EQ(refusal["id"], "param:/nothing");
  EXPECT_EQ(answer["parameters"], json::parse(R"([{"name": "/front/range_m", "value": 5.5, "type": "float64"}])"));
  EXPECT_EQ(answer["id"], "1");
  now += seconds(10);
  EXPECT_EQ(next_word()["op"], "removeStatus");
}

TEST_F(OneViewer, AReadOnlyViewerCannotSteer) {
  Viewer looker(host, {false, 0}, "127.0.0.1");
  looker.on_text(R"({"op": "setParameters", "parameters": [{"name": "/front/range_m", "value": 5}]})", now);
  EXPECT_EQ(host.values["/front/range_m"], foxglove::Value(10.0));
  EXPECT_THAT(text_of(*looker.next(now)), testing::HasSubstr("is read-only"));
  EXPECT_THAT(text_of(*looker.next(now)), testing::HasSubstr("10.0"));
  looker.on_binary(foxglove::encode(foxglove::ServiceCall{1, 2, "json", "{}"}), now);
  EXPECT_TRUE(host.calls.empty());
  EXPECT_THAT(text_of(*looker.next(now)), testing::HasSubstr("serviceCallFailure"));
}

TEST_F(OneViewer, RefusalsForAReadOnlyViewerStayFew) {
  Viewer looker(host, {false, 0}, "127.0.0.1");
  const std::string long_name(1000, 'x');
  for (int i = 0; i < 100; ++i) {
    looker.on_text(R"({"op": "setParameters", "parameters": [{"name": ")" + std::to_string(i) + long_name +
                       R"(", "value": 5}, {"name": "/b", "value": 5}]})",
                   now);
    const std::string refusal = text_of(*looker.next(now));
    EXPECT_LT(refusal.size(), 700u);
    EXPECT_EQ(refusal.find("\"id\"") != std::string::npos, i < 64)
        << "further messages have no id, so they do not disappear by themselves";
    EXPECT_THAT(text_of(*looker.next(now)), testing::HasSubstr("parameterValues"));
  }
}

TEST_F(OneViewer, ReadsThousandsOfKeysInProportionToTheirNumber) {
  const auto shortest_s = [this](int keys) {
    std::string word = R"({"op": "unknown")";
    for (int i = 0; i < keys; ++i) word += ", \"" + std::to_string(100000 + i) + "\":0";
    double shortest = 1e9;
    for (int i = 0; i < 7; ++i) {
      const std::clock_t start = std::clock();  // processor time of this process, so that other programs do not count
      viewer.on_text(word + "}", now);
      shortest = std::min(shortest, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    return shortest;
  };
  EXPECT_LT(shortest_s(9600), 24 * shortest_s(1200)) << "64 times as long if each key is compared with all others";
}

TEST_F(OneViewer, MayHaveFourOpenCallsOfServices) {
  for (std::uint32_t call = 1; call <= 5; ++call)
    viewer.on_binary(foxglove::encode(foxglove::ServiceCall{1, call, "json", "{}"}), now);
  EXPECT_EQ(host.calls.size(), 4u);
  EXPECT_EQ(next_word()["callId"], 5);
  EXPECT_EQ(next_word()["message"], "4 calls are open already") << "Lichtblick ignores the failure and shows the status";
  viewer.answer({1, 1, "json", "{}"});
  EXPECT_EQ(viewer.next(now)->head, foxglove::service_answer({1, 1, "json", "{}"}));
  viewer.on_binary(foxglove::encode(foxglove::ServiceCall{1, 6, "json", "{}"}), now);
  EXPECT_EQ(host.calls.size(), 5u);
}

TEST_F(OneViewer, GetsChangesOfSubscribedParameters) {
  const std::vector<foxglove::Parameter> changed{{"/front/range_m", 7.0}};
  viewer.on_parameters(changed);
  EXPECT_EQ(next_word(), json());
  say(R"({"op": "subscribeParameterUpdates", "parameterNames": ["/front/range_m"]})");
  viewer.on_parameters(changed);
  EXPECT_EQ(next_word()["parameters"][0]["value"], 7.0);
  say(R"({"op": "unsubscribeParameterUpdates", "parameterNames": []})");
  viewer.on_parameters(changed);
  EXPECT_EQ(next_word(), json());
}

TEST_F(OneViewer, TimeIsSentAtMostThirtyTimesPerSecondAndTheLastAlways) {
  viewer.set_time(Time(milliseconds(1)));
  EXPECT_EQ(viewer.next(now)->head, foxglove::time_frame(Time(milliseconds(1))));
  viewer.set_time(Time(milliseconds(1)));
  viewer.set_time(Time(milliseconds(2)));
  viewer.set_time(Time(milliseconds(3)));
  EXPECT_FALSE(viewer.next(now));
  now += milliseconds(33);
  EXPECT_EQ(viewer.next(now)->head, foxglove::time_frame(Time(milliseconds(3))));
}

TEST_F(OneViewer, StrayFieldsAndOperationsAreIgnoredWithOneWarning) {
  say(R"({"op": "getParameters", "parameterNames": [], "id": "x", "colour": 1})");
  EXPECT_EQ(next_word()["message"], "fields such as \"colour\" are ignored");
  EXPECT_EQ(next_word()["op"], "parameterValues");
  say(R"({"op": "unsubscribe", "subscriptionIds": [], "shape": 1})");
  say(R"({"op": "dance", "with": "me"})");
  EXPECT_EQ(next_word(), json());
}

TEST_F(OneViewer, OnlyAViewerOfATrajectoryCanPlayIt) {
  const foxglove::PlaybackControl asked{.pause = true, .speed = 2, .seeks = false, .to = {}, .request = "1"};
  viewer.on_binary(foxglove::encode(asked), now);
  EXPECT_THAT(next_word()["message"].get<std::string>(), testing::HasSubstr("playbackControl"));
  viewer.play("rov");
  viewer.on_binary(foxglove::encode(asked), now);
  ASSERT_EQ(host.playback.size(), 1u);
  EXPECT_TRUE(host.playback[0].pause);
  EXPECT_EQ(next_word(), json());
}

TEST_F(OneViewer, SubscriptionsAndParametersAreCounted) {
  for (std::uint32_t id = 1000; id < 1300; ++id) host.channels[id] = {{id, "/x", "protobuf", {}}, Kind::event, 0};
  for (std::uint32_t id = 1000; id < 1256; ++id, now += milliseconds(10)) subscribe(id);
  EXPECT_EQ(next_word(), json()) << "256 are accepted";
  subscribe(1256);
  EXPECT_EQ(next_word()["message"], "more than 256 subscriptions");
  std::string names;
  for (int i = 0; i < 65; ++i) names += (i == 0 ? "\"a\"" : ", \"a\"");
  say(R"({"op": "getParameters", "parameterNames": [)" + names + "]}");
  EXPECT_EQ(next_word()["message"], "more than 64 parameters in one request");
  say(std::string(17, '[') + std::string(17, ']'));
  EXPECT_EQ(next_word()["message"], "JSON nested deeper than 16");
  EXPECT_EQ(viewer.close_code(), Viewer::CloseCode::none);
}

TEST_F(OneViewer, ManyWrongMessagesEndTheConnection) {
  for (int i = 0; i < 9; ++i) say("nonsense");
  EXPECT_EQ(viewer.close_code(), Viewer::CloseCode::none);
  say("nonsense");
  EXPECT_EQ(viewer.close_code(), Viewer::CloseCode::policy);
  Viewer fast(host, {}, "127.0.0.1");
  for (int i = 0; i < 200; ++i) fast.on_text(R"({"op": "dance"})", now);
  EXPECT_EQ(fast.close_code(), Viewer::CloseCode::none);
  fast.on_text(R"({"op": "dance"})", now);
  EXPECT_EQ(fast.close_code(), Viewer::CloseCode::policy);
  Viewer lazy(host, {}, "127.0.0.1");
  for (int i = 0; i < 257; ++i) lazy.say("{}");
  EXPECT_EQ(lazy.close_code(), Viewer::CloseCode::try_again_later);
}

}  // namespace
}  // namespace sonar
