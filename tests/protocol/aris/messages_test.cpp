// Compares the bytes of commands, beacon and parts with vectors of the vendor's own programs.
#include "tests/protocol/aris/aris_testing.hpp"

namespace sonar::aris {
namespace {

using tests::hex;

TEST(ArisCommands, AreReadAsTheVendorsProgramsWriteThem) {
  CommandFramer framer;
  framer.append(hex("00000005 08 0E 82 01 00  00000008 08 01 1A 04 08 FC B8 03"));
  const auto ping = framer.next();
  ASSERT_TRUE(ping);
  Command command;
  ASSERT_TRUE(protobuf::read(*ping, command));
  EXPECT_EQ(command.type, CommandType::ping);
  const auto receiver = framer.next();
  ASSERT_TRUE(receiver);
  command = {};
  ASSERT_TRUE(protobuf::read(*receiver, command));
  EXPECT_EQ(command.type, CommandType::set_receiver);
  ASSERT_TRUE(command.receiver);
  EXPECT_EQ(command.receiver->port, 56444u);
  EXPECT_EQ(command.receiver->ip, "");
  EXPECT_FALSE(framer.next());
}

TEST(ArisCommands, ArriveInPiecesOfAnySize) {
  const Bytes bytes = framed(tests::set_acoustics(tests::acoustics(77)));
  CommandFramer framer;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    framer.append(BytesView(bytes).subspan(i, 1));
    EXPECT_FALSE(framer.next());
  }
  framer.append(BytesView(bytes).last(1));
  Command command;
  const auto message = framer.next();
  ASSERT_TRUE(message && protobuf::read(*message, command));
  EXPECT_EQ(command.acoustics, tests::acoustics(77));
}

TEST(ArisCommands, ZerosMayBeLeftOut) {
  Command command;
  ASSERT_TRUE(protobuf::read(hex("08 04 32 00"), command)) << "a controller with proto3 sends no value for fresh water";
  EXPECT_EQ(command.type, CommandType::set_salinity);
  ASSERT_TRUE(command.salinity);
  EXPECT_EQ(command.salinity->value, 0u);
  command = {};
  ASSERT_TRUE(protobuf::read(hex("12 03 0A 01 41"), command)) << "a command without a type sets the date";
  EXPECT_EQ(command.type, CommandType::set_date_time);
}

TEST(ArisCommands, WrongLengthsAndCutMessagesAreRefused) {
  CommandFramer framer;
  framer.append(hex("00001001 08"));
  EXPECT_FALSE(framer.next());
  EXPECT_TRUE(framer.broken());
  framer.append(hex("00000001 08"));
  EXPECT_FALSE(framer.next());
  for (const char* bad : {"08", "2A 05 08", "2A 02 FF FF", "08 FF FF FF FF FF FF FF FF FF FF 01", "0B", "2D 01 02", "00 00"}) {
    Command command;
    EXPECT_FALSE(protobuf::read(hex(bad), command)) << bad;
  }
  Command command;
  EXPECT_TRUE(protobuf::read(hex("F8 07 01 08 0E"), command)) << "fields that are not known are skipped";
  EXPECT_EQ(command.type, CommandType::ping);
}

TEST(ArisBeacon, IncludesZeroFields) {
  protocol::DeviceState state = tests::device("aris-1800");
  const Bytes free = make_beacon(state);
  EXPECT_LE(free.size(), 256u);
  // serial 7001, system type 0, version 2.8.8711, connection state 0, capability KA, Ethernet, 30, 70, 60, no diver, no variants
  EXPECT_EQ(free, hex("08 D9 36  10 00  1A 07 08 02 10 08 18 87 44  20 00  2A 04 0A 02 4B 41  38 01  45 00 00 F0 41"
                      "55 00 00 8C 42  58 3C  60 00  6A 00"));
  state.connected_client = {10, 0, 0, 7};
  Availability busy;
  ASSERT_TRUE(protobuf::read(make_beacon(state), busy));
  EXPECT_EQ(busy.busy, 1u);
  EXPECT_EQ(busy.serial, 7001u);
  EXPECT_FALSE(busy.power_down_reason);
  for (const auto& [profile, system] : {std::pair{"aris-1200", SystemType::aris_1200},
                                        {"aris-1800", SystemType::aris_1800},
                                        {"aris-3000", SystemType::aris_3000}}) {
    Availability a;
    ASSERT_TRUE(protobuf::read(make_beacon(tests::device(profile)), a));
    EXPECT_EQ(a.system, system);
  }
}

TEST(ArisParts, CoverTheFrameWithoutGapAndFitOldBuffers) {
  const Bytes header(header_size, std::byte{1});
  for (const std::size_t size : {std::size_t{48} * 128, std::size_t{128} * 946, std::size_t{128} * 4096}) {
    Bytes samples(size);
    for (std::size_t i = 0; i < size; ++i) samples[i] = static_cast<std::byte>(i * 7);
    std::size_t expected_at = 0;
    bool first = true;
    for (const Bytes& datagram : parts_of(9, header, samples)) {
      EXPECT_LE(datagram.size(), longest_datagram);
      FramePart part;
      ASSERT_TRUE(protobuf::read(datagram, part));
      EXPECT_EQ(part.frame_index, 9);
      EXPECT_EQ(static_cast<std::size_t>(part.total_size), size);
      EXPECT_EQ(part.header.has_value(), first);
      EXPECT_EQ(part.header.value_or(header).size(), 744u);
      ASSERT_EQ(static_cast<std::size_t>(part.data_offset), expected_at);
      EXPECT_TRUE(std::equal(part.data.begin(), part.data.end(), samples.begin() + part.data_offset));
      expected_at += part.data.size();
      first = false;
    }
    EXPECT_EQ(expected_at, size);
  }
  const auto parts = parts_of(1, header, Bytes(std::size_t{128} * 946));
  EXPECT_EQ(parts.size(), 89u);
  EXPECT_EQ(Bytes(parts[0].begin(), parts[0].begin() + 6), hex("08 01 10 80 B2 07"));
  EXPECT_EQ(Bytes(parts[0].end() - 2, parts[0].end()), hex("28 00")) << "an offset of 0 is written";
}

}  // namespace
}  // namespace sonar::aris
