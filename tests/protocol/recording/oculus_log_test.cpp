// Tests .oculus log files: their bytes, and files as other programs write them.
#include <zlib.h>

#include "protocol/recorded/byte_source.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::tests {
namespace {

using ::testing::HasSubstr;

template <class T>
T value_at(const Bytes& file, std::size_t at) {
  wire::Reader reader(BytesView(file).subspan(at));
  T value{};
  reader("value", value);
  EXPECT_TRUE(reader.ok());
  return value;
}

Bytes item(std::uint16_t type, const Bytes& payload, std::uint16_t compression = 0, std::uint32_t original = 0) {
  OculusLogItem head;
  head.type = type;
  head.at_unix_s = 1000.5;
  head.compression = compression;
  head.original_size = original == 0 ? static_cast<std::uint32_t>(payload.size()) : original;
  head.payload_size = static_cast<std::uint32_t>(payload.size());
  Bytes bytes = wire::bytes_of(head);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

Bytes log_of(std::initializer_list<Bytes> items) {
  Bytes file = wire::bytes_of(OculusLogHeader{});
  for (const Bytes& each : items) file.insert(file.end(), each.begin(), each.end());
  return file;
}

/// Returns the format of Qt's qCompress: the uncompressed length in big-endian, then zlib data.
Bytes compressed(const Bytes& plain) {
  std::vector<Bytef> in(plain.size()), out(compressBound(plain.size()));
  std::transform(plain.begin(), plain.end(), in.begin(), [](std::byte b) { return std::to_integer<Bytef>(b); });
  uLongf size = out.size();
  EXPECT_EQ(compress(out.data(), &size, in.data(), in.size()), Z_OK);
  Bytes bytes;
  wire::Writer writer(bytes, wire::Endian::big);
  const auto length = static_cast<std::uint32_t>(plain.size());
  writer("length", length);
  for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::byte>(out[i]));
  return bytes;
}

TEST(OculusLog, HasTheVendorsLayout) {
  const Bytes file = recorded(Format::oculus_log, conversation());
  EXPECT_EQ(value_at<std::uint32_t>(file, 0), 0x11223344u);
  EXPECT_EQ(value_at<std::uint32_t>(file, 4), 48u);
  EXPECT_EQ(file[8], std::byte{'O'});
  EXPECT_EQ(file[14], std::byte{0});
  EXPECT_EQ(value_at<std::uint16_t>(file, 24), 1);
  EXPECT_EQ(value_at<std::uint16_t>(file, 26), 0);
  EXPECT_EQ(value_at<std::int64_t>(file, 32), 0);
  EXPECT_NEAR(value_at<double>(file, 40), 1'700'000'000.123, 1e-3);
  EXPECT_EQ(value_at<std::uint32_t>(file, 48), 0xAABBCCDDu);
  EXPECT_EQ(value_at<std::uint32_t>(file, 52), 40u);
  EXPECT_EQ(value_at<std::uint16_t>(file, 56), 10);
  EXPECT_NEAR(value_at<double>(file, 64), 1'700'000'000.123, 1e-3);
  EXPECT_EQ(value_at<std::uint16_t>(file, 72), 0);
  EXPECT_EQ(value_at<std::uint32_t>(file, 76), 16u);
  EXPECT_EQ(value_at<std::uint32_t>(file, 80), 16u);
  EXPECT_EQ(value_at<std::uint16_t>(file, 88), 0x4F53);
  EXPECT_EQ(value_at<std::uint16_t>(file, 88 + 16 + 8), 1010);
  EXPECT_EQ(value_at<std::uint64_t>(file, 88 + 16 + 40), 1'700'000'000u);
  EXPECT_EQ(value_at<std::uint64_t>(file, 88 + 16 + 48), 123'456'789u);
}

TEST(OculusLog, ReadsFilesOfOtherPrograms) {
  const Bytes other = bytes_of("settings of some viewer");
  auto opened = open_bytes(log_of({item(1, other), item(10, ping_message(1)), item(500, other),
                                   item(10, compressed(ping_message(2)), 1, 2000), item(10, status_message())}));
  ASSERT_TRUE(opened);
  const Time at(std::chrono::milliseconds(1'000'500));
  expect_same(read_all(*opened->reader), {{at, Origin::device, Carrier::stream, ping_message(1)},
                                          {at, Origin::device, Carrier::stream, ping_message(2)},
                                          {at, Origin::device, Carrier::datagram, status_message()}});
  EXPECT_FALSE(opened->reader->damage());
}

TEST(OculusLog, ReportsItemsThatItCannotRead) {
  Bytes wrong_length = ping_message(1), broken = compressed(ping_message(1));
  wrong_length.pop_back();
  broken[20] ^= std::byte{0xFF};
  for (const auto& [bad, why] : std::initializer_list<std::pair<Bytes, const char*>>{
           {item(10, wrong_length), "the message at byte 48 has another length than its header gives"},
           {item(10, broken, 1), "the message at byte 48 does not decompress"},
           {item(10, ping_message(1), 7), "the message at byte 48 is compressed in a way that is not known: 7"},
           {item(10, bytes_of("SO")), "the message at byte 48 is shorter than a header"},
           {item(10, Bytes(5'000'000)), "has 5000000 bytes, more than any message"},
           {bytes_of("foreign bytes of any kind"), "no item begins at byte 48"}}) {
    auto opened = open_bytes(log_of({bad, item(10, dummy_message())}));
    ASSERT_TRUE(opened);
    EXPECT_EQ(device_stream(read_all(*opened->reader)), dummy_message()) << why;
    ASSERT_TRUE(opened->reader->damage()) << why;
    EXPECT_THAT(opened->reader->damage()->text, HasSubstr(why));
  }
}

TEST(OculusLog, AnImpossibleSizeLosesOnlyItsItem) {
  const Bytes whole = recorded(Format::oculus_log, conversation());
  Bytes expected = device_stream(conversation());
  expected.erase(expected.begin(), expected.begin() + static_cast<std::ptrdiff_t>(dummy_message().size()));
  Bytes damaged = whole;
  damaged[83] ^= std::byte{0x10};  // highest byte of the first payload's size
  auto opened = open_bytes(damaged);
  ASSERT_TRUE(opened);
  EXPECT_EQ(device_stream(read_all(*opened->reader)), expected);
  ASSERT_TRUE(opened->reader->damage());
  EXPECT_THAT(opened->reader->damage()->text, HasSubstr("the item at byte 48 is damaged: it would have 268435472 bytes"));

  auto cut = open_bytes({whole.begin(), whole.begin() + 95});
  ASSERT_TRUE(cut);
  EXPECT_TRUE(read_all(*cut->reader).empty());
  ASSERT_TRUE(cut->reader->damage());
  EXPECT_THAT(cut->reader->damage()->text, HasSubstr("an item of 16 bytes at byte 48 is cut short by the end of the file"));
}

TEST(OculusLog, OtherVersionsAreRefused) {
  Bytes newer = log_of({}), secret = log_of({});
  newer[24] = std::byte{2};
  secret[26] = std::byte{1};
  EXPECT_THAT(open_bytes(newer).error().text, HasSubstr("of version 2 are not read"));
  EXPECT_THAT(open_bytes(secret).error().text, HasSubstr("encrypted"));
  EXPECT_THAT(open_bytes(bytes_of("\x44\x33\x22\x11 short")).error().text, HasSubstr("ends within its file header"));
}

TEST(OculusLog, ALogWithoutMessagesIsValid) {
  auto opened = open_bytes(recorded(Format::oculus_log, {}));
  ASSERT_TRUE(opened);
  EXPECT_TRUE(read_all(*opened->reader).empty());
  EXPECT_FALSE(opened->reader->damage());
}

TEST(Inflate, StopsAtTheLimit) {
  const Bytes packed = compressed(Bytes(100'000));
  const BytesView stream = BytesView(packed).subspan(4);
  EXPECT_TRUE(inflate(stream, 100'000));
  EXPECT_FALSE(inflate(stream, 60'000));
  EXPECT_FALSE(inflate(stream.first(stream.size() - 3), 100'000));
}

}  // namespace
}  // namespace sonar::recording::tests
