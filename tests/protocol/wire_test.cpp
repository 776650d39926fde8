// Tests only the visitors of messages, with a message that was made for this test.
#include "protocol/wire/wire.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/docs/layout_table.hpp"

namespace sonar::wire_test {
namespace {

using sonar::wire::Bytes;
using sonar::wire::BytesView;

enum class Colour : std::uint16_t { red = 0x0102 };
enum class Meaning { colour, octets, share, words, parts };
struct Inner {
  std::int16_t left = 0;
  std::array<std::uint8_t, 3> octets{};
};
struct Outer {
  Colour colour{};
  std::array<Inner, 2> pair{};
  double level = 0;
  float share = 0;
};
constexpr void fields(auto& visit, sonar::wire::Like<Inner> auto& m) {
  visit("left", m.left);
  visit("octets", m.octets, Meaning::octets);
}
constexpr void fields(auto& visit, sonar::wire::Like<Outer> auto& m) {
  visit("colour", m.colour, Meaning::colour);
  visit("pair", m.pair);
  visit("level", m.level);
  visit("share", m.share, Meaning::share);
}
static_assert(sonar::wire::wire_size<Outer>() == 2 + 2 * 5 + 8 + 4);

Bytes bytes(std::initializer_list<int> values) {
  Bytes out;
  for (const int value : values) out.push_back(static_cast<std::byte>(value));
  return out;
}

Outer sample() {
  Outer outer;
  outer.colour = Colour::red;
  outer.pair = {Inner{-2, {1, 2, 3}}, Inner{300, {4, 5, 6}}};
  outer.level = 50;     // 40 49 00 .. 00
  outer.share = -1.5f;  // BF C0 00 00
  return outer;
}
const Bytes little =
    bytes({0x02, 0x01, 0xFE, 0xFF, 1, 2, 3, 0x2C, 0x01, 4, 5, 6, 0, 0, 0, 0, 0, 0, 0x49, 0x40, 0, 0, 0xC0, 0xBF});
const Bytes big = bytes({0x01, 0x02, 0xFF, 0xFE, 1, 2, 3, 0x01, 0x2C, 4, 5, 6, 0x40, 0x49, 0, 0, 0, 0, 0, 0, 0xBF, 0xC0, 0, 0});

TEST(Wire, WritesBothByteOrders) {
  EXPECT_EQ(sonar::wire::bytes_of(sample()), little);
  EXPECT_EQ(sonar::wire::bytes_of(sample(), sonar::wire::Endian::big), big);
}

struct Envelope {
  Outer first, second;
  std::array<std::uint32_t, 2> words{};
  std::uint8_t low = 0, high = 0;
};
constexpr void fields(auto& visit, sonar::wire::Like<Envelope> auto& m) {
  visit("first", m.first);
  visit("second", m.second);
  visit("words", m.words, Meaning::words);
  visit("low", m.low, Meaning::parts);
  visit("high", m.high, Meaning::parts);
}

TEST(Wire, LocatesFieldsByTheirMeaning) {
  using sonar::wire::Field;
  using sonar::wire::locate;
  EXPECT_EQ(locate<Outer>(Meaning::colour), (Field{Field::Type::integer, 0, 2}));
  EXPECT_EQ(locate<Envelope>(Meaning::colour), (Field{Field::Type::integer, 24, 2})) << "the last field";
  EXPECT_EQ(locate<Envelope>(Meaning::share), (Field{Field::Type::number, 44, 4}));
  EXPECT_EQ(locate<Inner>(Meaning::octets), (Field{Field::Type::bytes, 2, 3}));
  EXPECT_EQ(locate<Envelope>(Meaning::words), (Field{Field::Type::integer, 48, 4})) << "the first element";
  EXPECT_EQ(locate<Envelope>(Meaning::parts), (Field{Field::Type::bytes, 56, 2})) << "adjacent fields";
  EXPECT_FALSE(locate<Outer>(Meaning::words));
  EXPECT_TRUE(locate<Outer>(Meaning::share, little));
  EXPECT_FALSE(locate<Outer>(Meaning::share, BytesView(little).first(little.size() - 1)));
  EXPECT_EQ(locate<Inner>(Meaning::octets, little, 7), (Field{Field::Type::bytes, 9, 3})) << "the message begins at byte 7";
  EXPECT_FALSE(locate<Inner>(Meaning::octets, little, little.size() - 4));
}

TEST(Wire, ReadsBothByteOrders) {
  for (const auto endian : {sonar::wire::Endian::little, sonar::wire::Endian::big}) {
    Outer outer;
    sonar::wire::Reader reader(endian == sonar::wire::Endian::little ? little : big, endian);
    fields(reader, outer);
    EXPECT_TRUE(reader.ok());
    EXPECT_EQ(reader.remaining(), 0u);
    EXPECT_EQ(outer.colour, Colour::red);
    EXPECT_EQ(outer.pair[0].left, -2);
    EXPECT_EQ(outer.pair[1].octets[2], 6);
    EXPECT_EQ(outer.level, 50.0);
    EXPECT_EQ(outer.share, -1.5f);
  }
}

// Tries every length in a buffer of exactly that size, so that a sanitizer detects any read beyond it.
TEST(Wire, KeepsTheFirstFailureAndReadsNothingMore) {
  for (std::size_t length = 0; length < little.size(); ++length) {
    const std::unique_ptr<std::byte[]> exact(new std::byte[length]);
    std::copy_n(little.begin(), length, exact.get());
    Outer outer = sample();
    outer.share = 7;
    sonar::wire::Reader reader(BytesView(exact.get(), length));
    fields(reader, outer);
    EXPECT_FALSE(reader.ok()) << length;
    EXPECT_EQ(outer.share, 7) << "a field after the end was changed at length " << length;
    EXPECT_LE(reader.failure().offset, length);
    EXPECT_GT(reader.failure().needed, reader.failure().left);
  }
}

TEST(Wire, NamesTheMissingField) {
  Outer outer;
  sonar::wire::Reader reader(BytesView(little).first(15));
  fields(reader, outer);
  EXPECT_EQ(reader.failure_text(), "field 'level' at byte 12 needs 8 bytes, 3 are left");
  EXPECT_TRUE(reader.block("tail", 1).empty()) << "a failed reader gives no more bytes";
}

TEST(Wire, ReturnsBlocks) {
  sonar::wire::Reader reader(little);
  EXPECT_EQ(reader.block("head", 4).size(), 4u);
  EXPECT_EQ(reader.position(), 4u);
  EXPECT_TRUE(reader.block("too much", 100).empty());
  EXPECT_FALSE(reader.ok());
}

TEST(Wire, PrintsTheOffsetTable) {
  EXPECT_EQ(docs::layout_table<Outer>({{"octets", "three"}}),
            "| offset | type | field | meaning |\n|---|---|---|---|\n"
            "| 0 | u16 | colour |  |\n"
            "| 2 | i16 | pair.left |  |\n| 4 | u8 x 3 | pair.octets | three |\n"
            "| 7 | i16 | pair.left |  |\n| 9 | u8 x 3 | pair.octets | three |\n"
            "| 12 | f64 | level |  |\n| 20 | f32 | share |  |\n\n");
}

}  // namespace
}  // namespace sonar::wire_test
