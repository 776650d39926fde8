// Tests the golden pairs: name.bin decodes to name.json and name.json encodes to name.bin. The pairs are written by
// golden/make_golden.py, which shares nothing with the code under test.
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/protocol/oculus/json_of.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests::golden_test {
namespace {

using Json = nlohmann::json;

/// Fills a message from a JSON object, the reverse of ToJson. The object must have every name.
class FromJson : public wire::Visitor<FromJson> {
 public:
  explicit FromJson(const Json& object) : object_(object) {}

 private:
  friend class wire::Visitor<FromJson>;
  template <class T>
  static void take(const Json& json, T& value) {
    if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(json.get<std::underlying_type_t<T>>());
    } else {
      value = json.get<T>();
    }
  }
  template <wire::Scalar T>
  void scalar(std::string_view name, T& value) {
    take(object_.at(std::string(name)), value);
  }
  template <class A>
  void array(std::string_view name, A& values) {
    for (std::size_t i = 0; i < values.size(); ++i) take(object_.at(std::string(name)).at(i), values[i]);
  }
  template <class M>
  void nested(std::string_view name, M& message) {
    FromJson inner(object_.at(std::string(name)));
    fields(inner, message);
  }
  const Json& object_;
};

std::string text_of(const std::string& name) {
  std::ifstream file(std::string(SONARD_SOURCE_DIR) + "/tests/protocol/oculus/golden/" + name, std::ios::binary);
  EXPECT_TRUE(file) << name;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}
Bytes bytes_of_file(const std::string& name) {
  Bytes bytes;
  for (const char c : text_of(name + ".bin")) bytes.push_back(static_cast<std::byte>(c));
  return bytes;
}
Json json_of_file(const std::string& name) { return Json::parse(text_of(name + ".json")); }

template <class M>
void expect_pair(const std::string& name) {
  const Bytes bytes = bytes_of_file(name);
  const Json json = json_of_file(name)["fields"];
  M read{};
  wire::Reader reader(bytes);
  fields(reader, read);
  EXPECT_TRUE(reader.ok()) << name;
  EXPECT_EQ(json_of(read), json) << name;

  M made{};
  FromJson from(json);
  fields(from, made);
  const Bytes encoded = wire::bytes_of(made);
  EXPECT_EQ(encoded, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(encoded.size()))) << name;
}

TEST(Golden, FixedPartsHaveTheGoldenBytes) {
  expect_pair<FireMessageV1>("fire_v0");
  expect_pair<FireMessageV2>("fire_v2");
  expect_pair<StatusMessage>("status");
  expect_pair<PingResultV1>("ping_v0");
  expect_pair<PingResultV1>("ping_v1");
  expect_pair<PingResultV2>("ping_v2");
  expect_pair<DummyMessage>("dummy");
  expect_pair<UserConfigMessage>("user_config");
}

TEST(Golden, WholePingsHaveTheGoldenBytes) {
  for (const std::string name : {"ping_v0", "ping_v1", "ping_v2"}) {
    const Json blocks = json_of_file(name)["blocks"];
    const Bytes bytes = bytes_of_file(name);
    const auto ping = decode_ping(bytes);
    ASSERT_TRUE(ping.has_value()) << name;
    EXPECT_THAT(ping->violations, ::testing::IsEmpty()) << name;
    EXPECT_EQ(ping->bearings_cdeg, blocks["bearings"].get<std::vector<std::int16_t>>()) << name;
    EXPECT_EQ(ping->row_gains, blocks["rowGains"].get<std::vector<std::uint32_t>>()) << name;
    Bytes samples;
    for (std::size_t row = 0; row < ping->rows(); ++row)
      for (std::size_t beam = 0; beam < ping->beams(); ++beam) {
        EXPECT_EQ(ping->sample(row, beam), blocks["samples"][row][beam].get<std::uint32_t>()) << name;
        samples.push_back(static_cast<std::byte>(blocks["samples"][row][beam].get<int>()));
      }
    EXPECT_EQ(encode_ping(ping->head, {ping->bearings_cdeg, ping->row_gains, samples}), bytes) << name;
  }
}

}  // namespace
}  // namespace sonar::oculus::tests::golden_test
