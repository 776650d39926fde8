// MCAP: what a chunk must have beyond what a round trip shows, and the JSON for viewers. tests/acceptance/mcap_checker.py,
// written from the format's description alone, checks whole files.
#include <nlohmann/json.hpp>

#include "protocol/recording/zlib.hpp"
#include "protocol/wire/base64.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::testing {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using nlohmann::literals::operator""_json;

std::string text_of(const Bytes& bytes) {
  std::string text;
  for (const std::byte b : bytes) text += static_cast<char>(b);
  return text;
}

json json_of(const Bytes& bytes) { return json::parse(text_of(bytes)); }

Bytes session(const std::vector<RecordedMessage>& messages, bool closed = true) {
  Bytes file;
  McapSession writer(sink_into(file), "front");
  for (const RecordedMessage& message : messages) EXPECT_TRUE(writer.write(message));
  EXPECT_TRUE(writer.write_pose(after_ms(9000), after_ms(9000), {{1.5, -2, -3.25}, {1, 0, 0, 0}}));
  const std::vector<BeamTruth> beams{{12.5f, 3}, {}, {0.25f, 0}};
  const mcap::SceneNames names{{"floor", "a", "b", "wreck \"Ann\""}, {"boat", "gone"}};
  const std::vector<Pose> bodies{{{4, 2, -1}, {0, 0, 0, 1}}};
  EXPECT_TRUE(writer.write_truth(after_ms(9000), {7, after_ms(8999), {}, beams, bodies, &names}));
  if (closed) {
    EXPECT_TRUE(writer.close());
  }
  return file;
}

TEST(Crc32, KnownAnswer) { EXPECT_EQ(crc32(bytes_of("123456789")), 0xCBF43926u); }

TEST(Base64, KnownAnswers) {
  EXPECT_EQ(wire::base64(bytes_of("")), "");
  EXPECT_EQ(wire::base64(bytes_of("f")), "Zg==");
  EXPECT_EQ(wire::base64(bytes_of("fo")), "Zm8=");
  EXPECT_EQ(wire::base64(bytes_of("foobar")), "Zm9vYmFy");
  EXPECT_EQ(wire::base64(Bytes{std::byte{0xFB}, std::byte{0xFF}, std::byte{0}}), "+/8A");
}

TEST(Mcap, ChannelsForViewers) {
  auto reader = mcap::Reader::open(source_from("a file", session(conversation())));
  ASSERT_TRUE(reader);
  std::map<std::string, std::vector<mcap::Message>> found;
  while (auto message = reader->next()) {
    const std::string topic = reader->channels().at(message->channel).topic;
    EXPECT_EQ(message->sequence, found[topic].size());
    found[topic].push_back(std::move(*message));
  }
  EXPECT_FALSE(reader->damage());
  std::vector<std::string> topics;
  for (const auto& [topic, messages] : found) topics.push_back(topic);
  EXPECT_THAT(topics,
              ElementsAre("/front/client", "/front/device", "/front/image", "/front/pose", "/front/status", "/front/truth"));
  EXPECT_EQ(found["/front/image"].size(), 3u);
  EXPECT_EQ(reader->schemas().at(reader->channels().at(found["/front/image"][0].channel).schema).name, "foxglove.RawImage");
  EXPECT_EQ(
      json_of(found["/front/image"][0].data),
      R"({"timestamp":{"sec":1700000000,"nsec":223456789},"frame_id":"front","width":4,"height":5,"encoding":"mono8","step":4,
          "data":"AQgPFh0kKzI5QEdOVVxjanF4f4Y="})"_json);
  EXPECT_EQ(json_of(found["/front/pose"][0].data),
            R"({"timestamp":{"sec":1700000009,"nsec":123456789},"frame_id":"world","pose":{"position":{"x":1.5,"y":-2,"z":-3.25},
                "orientation":{"x":0,"y":0,"z":0,"w":1}}})"_json);
  EXPECT_EQ(json_of(found["/front/truth"][0].data),
            R"({"timestamp":{"sec":1700000009,"nsec":122456789},"ping":7,"sonar_in_world":{"position":{"x":0,"y":0,"z":0},
                "orientation":{"x":0,"y":0,"z":0,"w":1}},"range_m":[12.5,0,0.25],"object":[3,-1,0],
                "objects":[{"index":0,"name":"floor"},{"index":3,"name":"wreck \"Ann\""}],
                "bodies":[{"name":"boat","pose":{"position":{"x":4,"y":2,"z":-1},"orientation":{"x":0,"y":0,"z":1,"w":0}}}]})"_json);
}

std::vector<std::string> keys_of(const json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return keys;
}

TEST(Mcap, SchemasNameTheFieldsOfTheirMessages) {
  const auto keys_in = [](const mcap::JsonSchema& schema) { return keys_of(json::parse(schema.text).at("properties")); };
  const auto ping = oculus::decode_ping(ping_message(1, 2, 1, 8));
  ASSERT_TRUE(ping);
  EXPECT_EQ(keys_in(mcap::image_schema()), keys_of(json::parse(mcap::image_json({}, "front", *ping))));
  EXPECT_EQ(keys_in(mcap::pose_schema()), keys_of(json::parse(mcap::pose_json({}, "world", {}))));
  EXPECT_EQ(keys_in(mcap::truth_schema()), keys_of(json::parse(mcap::truth_json({}))));
}

TEST(Mcap, NamesAreEscapedAndBadUtf8IsReplaced) {
  EXPECT_EQ(json::parse(mcap::pose_json({}, "tab\there", {})).at("frame_id"), "tab\there");
  EXPECT_EQ(json::parse(mcap::pose_json({}, "a\xff", {})).at("frame_id"), "a\uFFFD");
}

TEST(Mcap, ImagesOfWiderSamples) {
  const auto wide = oculus::decode_ping(ping_message(1, 2, 1, 16)), widest = oculus::decode_ping(ping_message(1, 1, 1, 32));
  ASSERT_TRUE(wide && widest);
  EXPECT_THAT(mcap::image_json({}, "front", *wide), HasSubstr(R"("encoding":"16UC1","step":4,"data":"AQgPFg==")"));
  EXPECT_THAT(mcap::image_json({}, "front", *widest), HasSubstr(R"("encoding":"32FC1","step":4,)"));
}

TEST(Mcap, PingsOfOtherVendorsAreKeptAndSeenButNotReplayed) {
  Bytes file;
  McapSession writer(sink_into(file), "head", "blueview");
  Ping ping;
  ping.request.settings.beam_count = 2;
  ping.request.settings.range_bin_count = 1;
  ping.request.settings.format.bits = 16;
  ping.samples = bytes_of("abcd");
  EXPECT_TRUE(writer.write({after_ms(0), Origin::device, Carrier::stream, ping_message(1, 2, 1, 8)}));
  EXPECT_TRUE(writer.write_image(after_ms(0), ping));
  EXPECT_TRUE(writer.close());
  auto reader = mcap::Reader::open(source_from("a file", file));
  ASSERT_TRUE(reader);
  std::vector<std::string> topics;
  while (const auto message = reader->next()) {
    const mcap::Channel& channel = reader->channels().at(message->channel);
    topics.push_back(channel.topic + " " + channel.message_encoding);
    if (channel.topic != "/head/image") continue;
    EXPECT_THAT(text_of(message->data), HasSubstr(R"("width":2,"height":1,"encoding":"16UC1","step":4,"data":"YWJjZA==")"));
  }
  EXPECT_THAT(topics, ElementsAre("/head/device blueview", "/head/image json"));
  auto messages = read_mcap(source_from("a file", file));
  ASSERT_TRUE(messages);
  EXPECT_FALSE((*messages)->next());
}

TEST(Mcap, WithoutItsEndEverythingButTheLastChunkIsThere) {
  auto opened = open_bytes(session(conversation(), false));  // chunks of 2 s: the last one never reached the file
  ASSERT_TRUE(opened);
  std::vector<RecordedMessage> expected = conversation();
  expect_same(read_all(*opened->reader), expected);
  ASSERT_TRUE(opened->reader->damage());
  EXPECT_THAT(opened->reader->damage()->text, HasSubstr("it was not closed"));
}

TEST(Mcap, WhatIsWholeInACutChunkIsRead) {
  std::vector<RecordedMessage> messages = conversation();
  messages.resize(6);
  const Bytes whole = session(messages);
  auto opened = open_bytes({whole.begin(), whole.begin() + 5500});
  ASSERT_TRUE(opened);
  const std::vector<RecordedMessage> found = read_all(*opened->reader);
  EXPECT_GE(found.size(), 2u);
  EXPECT_EQ(found[0].bytes, conversation()[0].bytes);
  ASSERT_TRUE(opened->reader->damage());
  EXPECT_THAT(opened->reader->damage()->text, HasSubstr("is cut short by the end of the file"));
}

TEST(Mcap, SaysThatItReadsNoCompression) {
  Bytes file;
  const auto sink = sink_into(file);
  mcap::RecordWriter record(file);
  for (const std::uint8_t b : mcap::magic) record.number(b);
  record.begin(mcap::Opcode::chunk);
  record.time(start);
  record.time(start);
  record.number(std::uint64_t{1000});
  record.number(std::uint32_t{0});
  record.string("zstd");
  record.number(std::uint64_t{3});
  record.bytes(bytes_of("abc"));
  record.end();
  auto opened = open_bytes(file);
  ASSERT_TRUE(opened);
  EXPECT_FALSE(opened->reader->next());
  EXPECT_THAT(opened->reader->damage()->text, HasSubstr("is compressed (zstd), which is not read"));
}

TEST(Mcap, TimesThatAreNoneAreTheBeginning) {
  constexpr std::uint64_t top = std::uint64_t{1} << 63;
  for (const auto& [told, expected] :
       std::initializer_list<std::pair<std::uint64_t, std::int64_t>>{{0, 0},
                                                                     {4'000'000'000'000'000'000u, 4'000'000'000'000'000'000},
                                                                     {4'000'000'000'000'000'001u, 0},
                                                                     {top - 1, 0},
                                                                     {top, 0},
                                                                     {~std::uint64_t{0}, 0}}) {
    Bytes bytes;
    mcap::RecordWriter(bytes).number(told);
    EXPECT_EQ(mcap::RecordReader(bytes).time(), Time(std::chrono::nanoseconds(expected))) << told;
  }
}

TEST(Mcap, DescriptionsAreKeptWithinBounds) {
  Bytes file;
  for (const std::uint8_t b : mcap::magic) file.push_back(static_cast<std::byte>(b));
  mcap::append(file, mcap::Schema{1, "too long", "jsonschema", std::string(mcap::longest_description, 'x')});
  mcap::append(file, mcap::Schema{2, "long", "jsonschema", std::string(mcap::longest_description - 100, 'x')});
  for (std::uint16_t id = 0; id < 20; ++id)  // 19 MB
    mcap::append(file, mcap::Channel{id, 0, std::string(mcap::longest_description - 100, 'x'), "json", {}});
  auto reader = mcap::Reader::open(source_from("a file", std::move(file)));
  ASSERT_TRUE(reader);
  EXPECT_FALSE(reader->next());
  ASSERT_EQ(reader->schemas().size(), 1u);
  EXPECT_EQ(reader->schemas().at(2).name, "long");
  EXPECT_EQ(reader->schemas().at(2).text, "") << "not read";
  EXPECT_EQ(reader->channels().size(), 15u);
  ASSERT_TRUE(reader->damage());
  EXPECT_THAT(reader->damage()->text, HasSubstr("the record at byte 8 is too long, 10486"));
  EXPECT_THAT(reader->damage()->text, HasSubstr("; 5 more such places"));  // channels
}

TEST(Mcap, OneOfSeveralSonars) {
  Bytes file;
  mcap::Writer writer(sink_into(file));
  std::vector<std::uint16_t> channels;
  for (const char* name : {"left", "right"}) {
    mcap::Channel channel;
    channel.topic = std::string("/") + name + "/device";
    channel.message_encoding = "oculus";
    channel.metadata = {{"sonar", name}, {"from", "device"}, {"carrier", "tcp"}};
    channels.push_back(writer.add_channel(channel));
  }
  ASSERT_TRUE(writer.write(channels[0], start, ping_message(1)));
  ASSERT_TRUE(writer.write(channels[1], start, ping_message(2)));
  ASSERT_TRUE(writer.close());
  auto first = open_bytes(file), right = open_bytes(file, "right");
  ASSERT_TRUE(first && right);
  EXPECT_EQ(device_stream(read_all(*first->reader)), ping_message(1));
  EXPECT_EQ(first->reader->note(), "the file holds other sonars too: right");
  EXPECT_EQ(device_stream(read_all(*right->reader)), ping_message(2));
}

}  // namespace
}  // namespace sonar::recording::testing
