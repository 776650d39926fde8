// Tests MCAP files: properties of chunks that reading back does not check, and the messages for viewers.
// tests/acceptance/mcap_checker.py, which was written from the format's description alone, checks whole files.
#include <nlohmann/json.hpp>

#include "protocol/foxglove/foxglove_messages.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::tests {
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

/// Returns the messages by topic. Checks that those of each topic are numbered from 0, and the encoding of their schema.
std::map<std::string, std::vector<mcap::Message>> by_topic(const Bytes& file) {
  auto reader = mcap::Reader::open(source_from("a file", file));
  std::map<std::string, std::vector<mcap::Message>> found;
  while (auto message = reader->next()) {
    const mcap::Channel& channel = reader->channels().at(message->channel);
    EXPECT_EQ(message->sequence, found[channel.topic].size());
    if (channel.schema != 0) {
      const std::string encoding = reader->schemas().at(channel.schema).encoding;
      EXPECT_EQ(encoding, channel.message_encoding == "json" ? "jsonschema" : channel.message_encoding) << channel.topic;
    }
    found[channel.topic].push_back(std::move(*message));
  }
  EXPECT_FALSE(reader->damage());
  return found;
}

std::vector<std::string> topics_of(const std::map<std::string, std::vector<mcap::Message>>& found) {
  std::vector<std::string> topics;
  for (const auto& [topic, messages] : found) topics.push_back(topic);
  return topics;
}

Bytes image_of(Time at, const std::string& frame, std::size_t beams, std::size_t rows, int bits, const Bytes& codes) {
  const std::uint32_t full = 0xFFFFFFFFu >> (32 - bits);
  return foxglove::raw_image(at, frame, foxglove::image_of(beams, rows, bits, full, std::make_shared<const Bytes>(codes)));
}

TEST(Mcap, ViewersFindTheirChannels) {
  auto found = by_topic(session(conversation()));
  EXPECT_THAT(topics_of(found), ElementsAre("/front/client", "/front/device", "/front/image", "/front/pose", "/front/status",
                                            "/front/truth", "/tf"));
  EXPECT_EQ(found["/front/image"].size(), 3u);
  Bytes samples;
  for (unsigned i = 0; i < 20; ++i) samples.push_back(static_cast<std::byte>(7 * i + 1));
  EXPECT_EQ(found["/front/image"][0].data, image_of(after_ms(100), "front", 4, 5, 8, samples));
  const Pose sonar{{1.5, -2, -3.25}, {1, 0, 0, 0}};
  EXPECT_EQ(found["/front/pose"][0].data, foxglove::pose_in_frame(after_ms(9000), "world", sonar));
  const std::vector<foxglove::Transform> of_sonar{{after_ms(9000), "world", "front", sonar}},
      of_bodies{{after_ms(8999), "world", "object/boat", {{4, 2, -1}, {0, 0, 0, 1}}}};
  ASSERT_EQ(found["/tf"].size(), 2u);
  EXPECT_EQ(found["/tf"][0].data, foxglove::transforms(of_sonar));
  EXPECT_EQ(found["/tf"][1].data, foxglove::transforms(of_bodies));
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

TEST(Mcap, TheSchemaOfTruthNamesTheFieldsOfItsMessages) {
  EXPECT_EQ(keys_of(json::parse(mcap::truth_schema().text).at("properties")), keys_of(json::parse(mcap::truth_json({}))));
}

TEST(Mcap, NamesInTruthAreEscapedAndBadUtf8IsReplaced) {
  const mcap::SceneNames names{{"tab\there", "a\xff"}, {}};
  const std::vector<BeamTruth> beams{{1, 0}, {1, 1}};
  mcap::PingTruth truth;
  truth.beams = beams;
  truth.names = &names;
  const json objects = json::parse(mcap::truth_json(truth)).at("objects");
  EXPECT_EQ(objects.at(0).at("name"), "tab\there");
  EXPECT_EQ(objects.at(1).at("name"), "a\uFFFD");
}

TEST(Mcap, WiderSamplesHaveImages) {
  for (const int bits : {16, 32}) {
    const Bytes message = ping_message(1, 2, 1, static_cast<unsigned>(bits));
    Bytes samples;
    for (int i = 0; i < bits / 4; ++i) samples.push_back(static_cast<std::byte>(7 * i + 1));
    auto found = by_topic(session({{after_ms(0), Origin::device, Carrier::stream, message}}));
    ASSERT_EQ(found["/front/image"].size(), 1u);
    EXPECT_EQ(found["/front/image"][0].data, image_of(after_ms(0), "front", 2, 1, bits, samples)) << bits;
  }
}

TEST(Mcap, MessagesWithoutSamplesGetTheImageOfThePing) {
  Bytes file;
  McapSession writer(sink_into(file), "head", *protocol::find_make("blueview"));
  const auto ping = std::make_shared<Ping>();
  ping->request.settings.beam_count = 2;
  ping->request.settings.range_bin_count = 1;
  ping->request.settings.format.bits = 16;
  ping->samples = bytes_of("abcd");
  EXPECT_TRUE(writer.write({after_ms(0), Origin::device, Carrier::stream, ping_message(1, 2, 1, 8)}));
  EXPECT_TRUE(writer.write_image(after_ms(0), ping));
  EXPECT_TRUE(writer.close());
  auto found = by_topic(file);
  EXPECT_THAT(topics_of(found), ElementsAre("/head/device", "/head/image"));
  EXPECT_EQ(found["/head/image"].at(0).data, image_of(after_ms(0), "head", 2, 1, 16, bytes_of("abcd")));
  auto messages = read_mcap(source_from("a file", file));
  ASSERT_TRUE(messages);
  EXPECT_EQ(read_all(**messages).size(), 1u);
}

TEST(Mcap, RequestsOfClientsHaveTheCarrierOfTheMake) {
  for (const auto& [name, by] : {std::pair{"oculus", Carrier::stream}, std::pair{"ping360", Carrier::datagram}}) {
    Bytes file;
    McapSession writer(sink_into(file), "front", *protocol::find_make(name));
    EXPECT_TRUE(writer.write({after_ms(0), Origin::client, by, bytes_of("a request")}));
    EXPECT_TRUE(writer.close());
    auto messages = read_mcap(source_from("a file", file));
    ASSERT_TRUE(messages);
    expect_same(read_all(**messages), {{after_ms(0), Origin::client, by, bytes_of("a request")}});
  }
}

TEST(Mcap, TheStatedProfileNamesTheModelIfNoMessageDoes) {
  const auto sender_of_file = [](const std::string& profile) {
    Bytes file;
    McapSession writer(sink_into(file), "front", *protocol::find_make("oculus"), profile);
    EXPECT_TRUE(writer.write({after_ms(0), Origin::device, Carrier::stream, ping_message(1, 2, 1, 8)}));
    EXPECT_TRUE(writer.close());
    auto messages = read_mcap(source_from("a file", file));
    const auto by = messages ? find_sender(**messages) : std::nullopt;
    if (!by) throw std::runtime_error("no sender was found");
    EXPECT_EQ(read_all(**messages).size(), 1u) << "the reader is not at the start";
    return by->sender;
  };
  const Sender stated = sender_of_file("oculus-m3000d");
  EXPECT_TRUE(stated.names_model);
  EXPECT_EQ(stated.model->profile, "oculus-m3000d");
  EXPECT_NE(stated.serial, 0u) << "the serial number is still that of the message";
  for (const char* const profile : {"", "aris-3000", "nothing"}) {
    const Sender other = sender_of_file(profile);
    EXPECT_FALSE(other.names_model) << profile;
    EXPECT_EQ(other.model->profile, sender_of_file("").model->profile) << profile;
  }
}

TEST(Mcap, AFileWithoutItsEndLacksOnlyTheLastChunk) {
  auto opened = open_bytes(session(conversation(), false));  // chunks of 2 s: the last one never reached the file
  ASSERT_TRUE(opened);
  std::vector<RecordedMessage> expected = conversation();
  expect_same(read_all(*opened->reader), expected);
  ASSERT_TRUE(opened->reader->damage());
  EXPECT_THAT(opened->reader->damage()->text, HasSubstr("it was not closed"));
}

TEST(Mcap, BytesAfterTheEndAreReported) {
  const Bytes whole = session(conversation());
  for (const Bytes& more : {whole, bytes_of("x")}) {
    Bytes joined = whole;
    joined.insert(joined.end(), more.begin(), more.end());
    auto opened = open_bytes(joined);
    ASSERT_TRUE(opened);
    expect_same(read_all(*opened->reader), conversation());
    ASSERT_TRUE(opened->reader->damage());
    EXPECT_THAT(opened->reader->damage()->text,
                HasSubstr(std::to_string(more.size()) + " bytes after the end of the recording at byte " +
                          std::to_string(whole.size()) + " are not read"));
  }
  auto cut = open_bytes({whole.begin(), whole.end() - 1});
  ASSERT_TRUE(cut);
  expect_same(read_all(*cut->reader), conversation());
  EXPECT_FALSE(cut->reader->damage()) << "the data of the file are complete";
}

TEST(Mcap, CompleteRecordsOfATruncatedChunkAreRead) {
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

TEST(Mcap, ImpossibleRecordsAreReported) {
  const auto damage_with = [](const Bytes& record, bool reads_on) {
    Bytes file = session(conversation());
    file.insert(file.begin() + static_cast<std::ptrdiff_t>(mcap::magic.size()), record.begin(), record.end());
    auto opened = open_bytes(file);
    if (!opened) return opened.error().text;
    EXPECT_EQ(read_all(*opened->reader).size(), reads_on ? conversation().size() : 0u);
    const auto damage = opened->reader->damage();
    return damage ? damage->text : std::string();
  };
  const auto record_of = [](unsigned opcode) {
    Bytes record;
    mcap::RecordWriter writer(record);
    writer.begin(static_cast<mcap::Opcode>(opcode));
    writer.bytes(bytes_of("ten bytes."));
    writer.end();
    return record;
  };
  EXPECT_EQ(damage_with(record_of(0x0C), true), "") << "metadata";
  EXPECT_EQ(damage_with(record_of(0x80), true), "") << "a record of an application is no damage";
  for (const unsigned reserved : {0x10u, 0x42u, 0x7Fu}) EXPECT_EQ(damage_with(record_of(reserved), true), "") << reserved;
  const auto chunk_of = [](const Bytes& records) {
    Bytes chunk;
    mcap::RecordWriter writer(chunk);
    writer.begin(mcap::Opcode::chunk);
    writer.time(start);
    writer.time(start);
    writer.number(std::uint64_t{records.size()});
    writer.number(std::uint32_t{0});  // no checksum
    writer.string("");
    writer.number(std::uint64_t{records.size()});
    writer.bytes(records);
    writer.end();
    return chunk;
  };
  for (const unsigned added : {0x10u, 0x7Fu, 0x80u}) EXPECT_EQ(damage_with(chunk_of(record_of(added)), true), "") << added;
  EXPECT_THAT(damage_with(chunk_of(record_of(0x08)), true), HasSubstr("has the opcode 8, which no record of a chunk has"));
  EXPECT_THAT(damage_with(Bytes(20), false), HasSubstr("the record at byte 8 has the opcode 0, which no record has"));
}

TEST(Mcap, CompressionIsRefusedWithAReason) {
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

TEST(Mcap, ImpossibleTimesBecomeZero) {
  constexpr std::uint64_t top = std::uint64_t{1} << 63;
  for (const auto& [stored, expected] :
       std::initializer_list<std::pair<std::uint64_t, std::int64_t>>{{0, 0},
                                                                     {4'000'000'000'000'000'000u, 4'000'000'000'000'000'000},
                                                                     {4'000'000'000'000'000'001u, 0},
                                                                     {top - 1, 0},
                                                                     {top, 0},
                                                                     {~std::uint64_t{0}, 0}}) {
    Bytes bytes;
    mcap::RecordWriter(bytes).number(stored);
    EXPECT_EQ(mcap::RecordReader(bytes).time(), Time(std::chrono::nanoseconds(expected))) << stored;
  }
}

TEST(Mcap, DescriptionsAreKeptWithinBounds) {
  Bytes file;
  for (const std::uint8_t b : mcap::magic) file.push_back(static_cast<std::byte>(b));
  mcap::append(file, mcap::Schema{1, "too long", "jsonschema", Bytes(mcap::longest_description)});
  mcap::append(file, mcap::Schema{2, "long", "jsonschema", Bytes(mcap::longest_description - 100)});
  for (std::uint16_t id = 0; id < 20; ++id)  // 19 MB
    mcap::append(file, mcap::Channel{id, 0, std::string(mcap::longest_description - 100, 'x'), "json", {}});
  auto reader = mcap::Reader::open(source_from("a file", std::move(file)));
  ASSERT_TRUE(reader);
  EXPECT_FALSE(reader->next());
  ASSERT_EQ(reader->schemas().size(), 1u);
  EXPECT_EQ(reader->schemas().at(2).name, "long");
  EXPECT_TRUE(reader->schemas().at(2).data.empty()) << "the description was not read";
  EXPECT_EQ(reader->channels().size(), 15u);
  ASSERT_TRUE(reader->damage());
  EXPECT_THAT(reader->damage()->text, HasSubstr("the record at byte 8 is too long, 10486"));
  EXPECT_THAT(reader->damage()->text, HasSubstr("; 5 more such places"));  // five of the twenty channels
}

TEST(Mcap, OneOfSeveralSonarsCanBeSelected) {
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
}  // namespace sonar::recording::tests
