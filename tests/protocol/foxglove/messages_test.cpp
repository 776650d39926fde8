// Tests that every message can be read back with only the descriptors that viewers receive.
#include "protocol/foxglove/foxglove_messages.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <bit>
#include <nlohmann/json.hpp>

#include "core/base/base64.hpp"
#include "protocol/foxglove/glb.hpp"

namespace sonar::foxglove {
namespace {

namespace pb = google::protobuf;
using nlohmann::json;
using nlohmann::literals::operator""_json;

std::string decoded(const std::string& text) { return from_base64(text).value_or("not base64"); }

json read_back(const std::string& name, const Bytes& message) {
  pb::FileDescriptorSet set;
  EXPECT_TRUE(set.ParseFromString(decoded(protobuf_schema(name).text)));
  pb::DescriptorPool pool;
  for (const auto& file : set.file()) EXPECT_NE(pool.BuildFile(file), nullptr) << file.name();
  const pb::Descriptor* const type = pool.FindMessageTypeByName(name);
  if (type == nullptr) return "no " + name;
  pb::DynamicMessageFactory factory(&pool);
  const std::unique_ptr<pb::Message> read(factory.GetPrototype(type)->New());
  EXPECT_TRUE(read->ParseFromArray(message.data(), static_cast<int>(message.size())));
  EXPECT_TRUE(read->GetReflection()->GetUnknownFields(*read).empty());
  std::string text;
  pb::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  EXPECT_TRUE(pb::util::MessageToJsonString(*read, &text, options).ok());
  return json::parse(text);
}

const Time at{std::chrono::milliseconds(1500)};

std::shared_ptr<Ping> ping_of(int bits) {
  const auto ping = std::make_shared<Ping>();
  PingSettings& s = ping->request.settings;
  s.beam_count = 3;
  s.range_bin_count = 2;
  s.format = {.bits = bits, .max_code = bits > 16 ? 8u : 255u};
  ping->beam_azimuth_rad = {0.5f, 0, -0.5f};
  for (int i = 0; i < 6; ++i)
    for (int b = 0; b < bits / 8; ++b) ping->samples.push_back(static_cast<std::byte>(b == 0 ? i : 0));
  return ping;
}

json read_image(int bits) { return read_back("foxglove.RawImage", raw_image(at, "front", image_of(ping_of(bits)))); }

TEST(FoxgloveMessages, ImagesHaveTheirFields) {
  const json image = read_image(8);
  EXPECT_EQ(image["timestamp"], "1970-01-01T00:00:01.500Z");
  EXPECT_EQ(image["width"], 3);
  EXPECT_EQ(image["height"], 2);
  EXPECT_EQ(image["step"], 3);
  EXPECT_EQ(image["encoding"], "mono8");
  EXPECT_EQ(image["frame_id"], "front");
  EXPECT_EQ(decoded(image["data"]), std::string("\0\1\2\3\4\5", 6));
  EXPECT_EQ(read_image(16)["encoding"], "mono16");
  EXPECT_EQ(read_image(16)["step"], 6);
  for (const int bits : {24, 32}) {
    const json parts = read_image(bits);
    EXPECT_EQ(parts["encoding"], "32FC1");
    EXPECT_EQ(parts["step"], 12);
    const std::string data = decoded(parts["data"]);
    ASSERT_EQ(data.size(), 24u);
    std::uint32_t last = 0;
    for (std::size_t i = 24; i-- > 20;) last = last << 8 | static_cast<unsigned char>(data[i]);
    EXPECT_EQ(std::bit_cast<float>(last), 5.0f / 8);
  }
}

TEST(FoxgloveMessages, SamplesAreNotCopied) {
  const auto ping = ping_of(8);
  EXPECT_EQ(image_of(ping).samples.get(), &ping->samples);
}

TEST(FoxgloveMessages, TransformsAndLinesHaveTheirFields) {
  const std::vector<Transform> frames{{at, "world", "rov", {{1, 2, 3}, {0, 1, 0, 0}}}};
  const json frame = read_back("foxglove.FrameTransforms", transforms(frames))["transforms"][0];
  EXPECT_EQ(frame["translation"], R"({"x": 1.0, "y": 2.0, "z": 3.0})"_json);
  EXPECT_EQ(frame["rotation"], R"({"x": 1.0, "y": 0.0, "z": 0.0, "w": 0.0})"_json);
  EXPECT_EQ(frame["parent_frame_id"], "world");
  EXPECT_EQ(read_back("foxglove.PoseInFrame", pose_in_frame(at, "world", {}))["pose"]["orientation"]["w"], 1.0);
  const json log = read_back("foxglove.Log", log_line(at, Severity::warning, "text", "front"));
  EXPECT_EQ(log["level"], "WARNING");
  EXPECT_EQ(log["name"], "front");
}

TEST(FoxgloveMessages, JoinedSceneUpdatesAreOneUpdate) {
  const Bytes glb(3, std::byte{7});
  Bytes update = scene_update(at, Model{"crate", "world", {{1, 0, 0}, {}}, {{"material", "steel"}}, glb});
  const Bytes lines = scene_update(at, Lines{"swath", "front", {{0, 0, 0}, {1, 0, 0}}}), gone = scene_deletion(at, "wreck");
  update.insert(update.end(), lines.begin(), lines.end());
  update.insert(update.end(), gone.begin(), gone.end());
  const json scene = read_back("foxglove.SceneUpdate", update);
  ASSERT_EQ(scene["entities"].size(), 2u);
  EXPECT_EQ(scene["entities"][0]["models"][0]["media_type"], "model/gltf-binary");
  EXPECT_EQ(decoded(scene["entities"][0]["models"][0]["data"]), "\7\7\7");
  EXPECT_EQ(scene["entities"][0]["metadata"][0]["value"], "steel");
  EXPECT_EQ(scene["entities"][1]["lines"][0]["points"].size(), 2u);
  EXPECT_EQ(scene["deletions"][0]["id"], "wreck");
}

TEST(FoxgloveMessages, CloudsAndGeometryHaveTheirFields) {
  const json points = read_back("foxglove.PointCloud", cloud(at, "front", std::vector<CloudPoint>{{1, 2, 0, 200}}));
  EXPECT_EQ(points["point_stride"], 16);
  EXPECT_EQ(points["fields"][3], R"({"name": "intensity", "offset": 12, "type": "UINT8"})"_json);
  const std::string data = decoded(points["data"]);
  ASSERT_EQ(data.size(), 16u);
  EXPECT_EQ(data.substr(4, 4), std::string("\0\0\0\x40", 4));
  EXPECT_EQ(static_cast<unsigned char>(data[12]), 200);
  const json shape = read_back("sonar.v1.PingGeometry", geometry(*ping_of(8), 7));
  EXPECT_EQ(shape["number"], 7);
  EXPECT_EQ(shape["full_scale"], 255.0);
  EXPECT_EQ(shape["azimuth_rad"], R"([0.5, 0.0, -0.5])"_json);
}

TEST(FoxgloveMessages, TruthHasTheHitOfEachBeam) {
  const auto ping = ping_of(8);
  ping->request.fired_at = at;
  ping->request.number = PingNumber{7};
  ping->request.settings.range_m = 12;
  ping->truth = {{3.5f, 2}, {}, {4.25f, 0}};  // the second beam hits nothing
  const json read = read_back("sonar.v1.PingTruth", truth(*ping));
  EXPECT_EQ(read["timestamp"], "1970-01-01T00:00:01.500Z");
  EXPECT_EQ(read["number"], 7);
  EXPECT_EQ(read["azimuth_rad"], R"([0.5, 0.0, -0.5])"_json);
  EXPECT_EQ(read["range_m"], R"([3.5, 0.0, 4.25])"_json);
  EXPECT_EQ(read["range_end_m"], 12.0);
  const auto later = [](Time was) { return was + std::chrono::hours(1); };
  const Bytes shifted = with_stamps({1, "/x", "protobuf", {"sonar.v1.PingTruth", "protobuf", ""}}, truth(*ping), later);
  ping->request.fired_at = later(at);
  EXPECT_EQ(shifted, truth(*ping));
}

TEST(FoxgloveMessages, StampsCanBeReplaced) {
  const auto later = [](Time was) { return was + std::chrono::hours(1); };
  const auto of = [](const char* schema) { return Channel{1, "/x", "protobuf", {schema, "protobuf", ""}}; };
  const Time then{std::chrono::milliseconds(1500)};
  const std::vector<Transform> places{{then, "world", "rov", {}}, {then + std::chrono::seconds(1), "rov", "front", {}}};
  const std::vector<Transform> shifted{{later(then), "world", "rov", {}},
                                       {later(then + std::chrono::seconds(1)), "rov", "front", {}}};
  EXPECT_EQ(with_stamps(of("foxglove.FrameTransforms"), transforms(places), later), transforms(shifted));
  EXPECT_EQ(with_stamps(of("foxglove.SceneUpdate"), scene_deletion(then, "crate"), later), scene_deletion(later(then), "crate"));
  const Image image{2, 1, "mono8", 1, std::make_shared<const Bytes>(2, std::byte{7})};
  const auto whole = [&image](Time stamp) {
    Bytes bytes = image_head(stamp, "front", image);
    bytes.insert(bytes.end(), image.samples->begin(), image.samples->end());
    return bytes;
  };
  const auto same = [](Time was) { return was; };  // with_stamps() writes the fields in another order
  EXPECT_EQ(with_stamps(of("foxglove.RawImage"), whole(then), later),
            with_stamps(of("foxglove.RawImage"), whole(later(then)), same));
  // sonar.v1.PingEvent: number = 7, fired_at_ns = 1
  const Bytes event{std::byte{0x10}, std::byte{7}, std::byte{0x19}, std::byte{1}, {}, {}, {}, {}, {}, {}, {}};
  const Bytes changed =
      with_stamps(of("sonar.v1.PingEvent"), event, [](Time fired) { return fired + std::chrono::nanoseconds(4); });
  ASSERT_EQ(changed.size(), event.size());
  EXPECT_EQ(changed[3], std::byte{5});
  std::array<double, figure_names.size()> values{1.5, 2, 3};
  const Bytes before = figures(values);
  values[0] += 3600;
  EXPECT_EQ(with_stamps({1, "/front/figures", "cdr", figures_schema()}, before, later), figures(values));
}

TEST(FoxgloveMessages, StatusIsDescribedToo) {
  EXPECT_NE(protobuf_schema("sonar.v1.DaemonStatus").text, "");
  EXPECT_NE(protobuf_schema("sonar.v1.Findings").text, "");
  EXPECT_EQ(protobuf_schema("sonar.v1.Nothing").text, "");
}

TEST(Glb, HasTheBytesOfATriangle) {
  const std::vector<Vec3> vertices{{0, 0, 1}, {2, 0, 1}, {0, 3, 1}};
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}};
  const Bytes file = glb(vertices, triangles, {0.5, 0.25, 1});
  wire::Reader reader(file);
  std::array<std::uint32_t, 5> header{};
  reader("header", header);
  EXPECT_EQ(header[0], 0x46546C67u);
  EXPECT_EQ(header[2], file.size());
  const BytesView text = reader.block("json", header[3]);
  const json description =
      json::parse(reinterpret_cast<const char*>(text.data()), reinterpret_cast<const char*>(text.data()) + text.size());
  EXPECT_EQ(description["accessors"][0]["min"], R"([0.0, 1.0, -3.0])"_json);
  EXPECT_EQ(description["accessors"][0]["max"], R"([2.0, 1.0, 0.0])"_json);
  EXPECT_EQ(description["accessors"][2]["count"], 3);
  EXPECT_EQ(description["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"], R"([0.5, 0.25, 1.0, 1])"_json);
  std::array<std::uint32_t, 2> chunk{};
  std::array<float, 18> vectors{};
  std::array<std::uint32_t, 3> indices{};
  reader("chunk", chunk);
  reader("vectors", vectors);
  reader("indices", indices);
  EXPECT_TRUE(reader.ok() && reader.remaining() == 0);
  EXPECT_EQ(chunk[0], 84u);
  EXPECT_EQ(vectors[8], -3);  // the third corner: minus our y
  EXPECT_EQ(vectors[10], 1);  // normals point up, which is y in glTF
  EXPECT_EQ(indices[2], 2u);
}

TEST(RosCdr, HasFifteenNumbersAfterFourBytes) {
  std::array<double, figure_names.size()> values{};
  values[1] = 2;
  const Bytes message = figures(values);
  ASSERT_EQ(message.size(), 4 + 15 * sizeof(double));
  EXPECT_EQ(message[1], std::byte{1});
  EXPECT_EQ(message[4 + 15], std::byte{0x40});
  EXPECT_TRUE(figures_schema().text.starts_with("float64 stamp_s\nfloat64 number\n"));
}

}  // namespace
}  // namespace sonar::foxglove
