// Tests the driver-side decoder: each broken ping gives its own error, and none makes the decoder read beyond the message.
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const FireRequest gains_fire = fire(0, 2, PingRate::hz10, 0x0D, 0.3, 50);

Bytes sound_ping(int version = 0) {
  FireRequest request = gains_fire;
  request.version = static_cast<std::uint16_t>(version);
  return answer(device(), request).message;
}

std::vector<std::string> violations_after(std::size_t offset, const char* bytes, int version = 0) {
  Bytes ping = sound_ping(version);
  overwrite(ping, offset, hex(bytes));
  const auto decoded = decode_ping(Exact(ping).view());
  return decoded ? decoded->violations : std::vector<std::string>{"unreadable"};
}

// Offsets of versions 1 and 2, typed from the published layouts.
TEST(Identities, EveryBrokenIdentityIsReported) {
  ASSERT_THAT(violations_after(0, "53 4F"), IsEmpty());
  ASSERT_THAT(violations_after(0, "53 4F", 2), IsEmpty());
  EXPECT_THAT(violations_after(0, "00"), Contains(HasSubstr("oculus_id is")));
  EXPECT_THAT(violations_after(2, "00 00"), Contains("src_device_id is 0"));
  EXPECT_THAT(violations_after(6, "22 00"), Contains(HasSubstr("msg_id is 34")));
  EXPECT_THAT(violations_after(8, "09 00", 2), Contains("msg_version 9 does not exist"));
  EXPECT_THAT(violations_after(10, "01 00 00 00"), Contains(HasSubstr("payload_size + 16 is 17 but")));
  EXPECT_THAT(violations_after(118, "01 00 00 00"), Contains(HasSubstr("message_size is 1 but")));
  EXPECT_THAT(violations_after(114, "01 00 00 00"), Contains(HasSubstr("image_size is 1 but rows x")));
  EXPECT_THAT(violations_after(110, "7A 00 00 00"), Contains(HasSubstr("must exceed 122")));
  EXPECT_THAT(violations_after(110, "7B 00 00 00"), Contains(HasSubstr("inside the bearing table")));
  EXPECT_THAT(violations_after(110, "FF FF FF FF"), Contains("the image does not lie inside the message"));
  EXPECT_THAT(violations_after(106, "FF FF"), Contains("the image does not lie inside the message"));
  EXPECT_THAT(violations_after(106, "00 00"), Contains("there is no row"));
  EXPECT_THAT(violations_after(108, "00 00"), Contains("there is no beam"));
  EXPECT_THAT(violations_after(97, "04"), Contains("data_size 4 is unknown"));
  EXPECT_THAT(violations_after(97, "01"), Contains("data_size contradicts the echoed flags"));
  EXPECT_THAT(violations_after(20, "09"), Contains(HasSubstr("image_size is"))) << "the echoed flags state no row gains";
  EXPECT_THAT(violations_after(122, "FF 7F"), Contains("bearings do not ascend"));
  EXPECT_THAT(violations_after(2048, "00 00 00 00"), Contains("a row gain is 0"));
  EXPECT_THAT(violations_after(98, "00 00 00 00 00 00 00 00"), Contains(HasSubstr("range_resolution 0")));
  EXPECT_THAT(violations_after(85, "00 00 00 00 00 00 F8 7F"), Contains(HasSubstr("speed_of_sound_used nan")));
  EXPECT_THAT(violations_after(61, "00 00 00 00 00 00 F0 FF"), Contains(HasSubstr("frequency -inf")));
  EXPECT_THAT(violations_after(69, "00 00 00 00 00 00 F8 7F"), Contains("temperature or pressure is not finite"));
  EXPECT_THAT(violations_after(190, "FF FF FF FF", 2), Contains("the image does not lie inside the message"));
}

TEST(Decoder, TrailingBytesAreReported) {
  const auto decoded = decode_ping(joined({sound_ping(), Bytes(1)}));
  ASSERT_TRUE(decoded.has_value());
  EXPECT_THAT(decoded->violations, SizeIs(2));
}

TEST(Decoder, EveryTruncationIsSurvived) {
  for (const int version : {0, 2}) {
    const Bytes whole = sound_ping(version);
    const std::size_t fixed = version == 2 ? ping_v2_size : ping_v1_size;
    for (std::size_t length = 0; length < whole.size(); length += (length < 2100 || length + 200 > whole.size() ? 1 : 61)) {
      const auto decoded = decode_ping(Exact(BytesView(whole).first(length)).view());
      EXPECT_EQ(decoded.has_value(), length >= fixed) << length;
      if (decoded) {
        EXPECT_FALSE(decoded->has_image) << length;
        EXPECT_FALSE(decoded->violations.empty()) << length;
      }
    }
  }
}

TEST(Decoder, EveryFlippedHeadByteIsSurvived) {
  const Bytes whole = sound_ping();
  for (std::size_t i = 0; i < 200; ++i) {
    for (const unsigned flip : {0x01u, 0x80u, 0xFFu}) {
      Bytes flipped = whole;
      flipped[i] ^= static_cast<std::byte>(flip);
      const auto decoded = decode_ping(Exact(flipped).view());
      if (!decoded || !decoded->has_image) continue;
      std::uint64_t sum = 0;  // reads every sample that the ping states
      for (std::size_t row = 0; row < decoded->rows(); ++row)
        for (std::size_t beam = 0; beam < decoded->beams(); ++beam) sum += decoded->sample(row, beam);
      EXPECT_LE(sum, std::uint64_t{0xFFFFFFFF} * decoded->rows() * decoded->beams());
    }
  }
}

TEST(Decoder, Reads24Bit) {
  PingHead head;
  head.fixed.header.source = 1;
  head.fixed.fire.flags = flag::samples_16_bit;
  head.fixed.data_size = DataSize::bits24;
  head.fixed.row_count = 1;
  head.fixed.beam_count = 2;
  head.fixed.range_resolution_m = head.fixed.sound_speed_mps = head.fixed.frequency_hz = 1;
  const std::int16_t bearings[] = {-1, 1};
  const auto ping = decode_ping(encode_ping(head, {bearings, {}, hex("56 34 12  FF FF FF")}));
  ASSERT_TRUE(ping.has_value());
  EXPECT_THAT(ping->violations, IsEmpty());
  EXPECT_EQ(ping->sample(0, 0), 0x123456u);
  EXPECT_EQ(ping->sample(0, 1), 0xFFFFFFu);
}

TEST(Decoder, AStreamMayComeInAnyPieces) {
  const Bytes ping = sound_ping();
  const Bytes dummy = hex("53 4F 59 1B 00 00 FF 00 00 00 00 00 00 00 00 00");
  const Bytes stream = joined({dummy, ping, hex("53 00 4F"), ping, dummy});
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{701}, std::size_t{65536}}) {
    Decoder decoder;
    int pings = 0, dummies = 0;
    for (std::size_t i = 0; i < stream.size(); i += piece) {
      decoder.append(BytesView(stream).subspan(i, std::min(piece, stream.size() - i)));
      while (const auto received = decoder.next()) {
        pings += std::holds_alternative<DecodedPing>(*received) ? 1 : 0;
        dummies += std::holds_alternative<DummyMessage>(*received) ? 1 : 0;
      }
    }
    EXPECT_EQ(pings, 2) << piece;
    EXPECT_EQ(dummies, 2) << piece;
    EXPECT_EQ(decoder.skipped_bytes(), 3u) << piece;
    EXPECT_EQ(decoder.buffered_bytes(), 0u) << piece;
  }
}

TEST(Decoder, HugeLengthsAreJunk) {
  Decoder decoder;
  decoder.append(hex("53 4F 01 00 00 00 23 00 00 00 F0 FF FF FF 00 00"));
  EXPECT_FALSE(decoder.next().has_value());
  EXPECT_LT(decoder.buffered_bytes(), 16u);
}

TEST(Decoder, UnreadableMessagesHaveAReason) {
  const auto shorty = decode_message(hex("53 4F 01 00 00 00 23 00 00 00 01 00 00 00 00 00  07"));
  ASSERT_TRUE(std::holds_alternative<OtherMessage>(shorty));
  EXPECT_EQ(std::get<OtherMessage>(shorty).why, "a ping result shorter than its fixed part");
  const auto config = decode_message(hex("53 4F 01 00 00 00 55 00 00 00 01 00 00 00 00 00  07"));
  ASSERT_TRUE(std::holds_alternative<OtherMessage>(config));
  EXPECT_THAT(std::get<OtherMessage>(config).why, HasSubstr("'ipAddr' at byte 16"));
}

TEST(Echo, EveryDifferenceIsReported) {
  const DecodedPing ping = answer(device(), gains_fire);
  EXPECT_THAT(echo_violations(gains_fire, ping), IsEmpty());
  const auto differs = [&](auto change) {
    FireRequest sent = gains_fire;
    change(sent.settings);
    return echo_violations(sent, ping);
  };
  EXPECT_THAT(differs([](FireSettings& s) { s.mode = 1; }), Contains(HasSubstr("echoed mode is 2")));
  EXPECT_THAT(differs([](FireSettings& s) { s.gamma = 3; }), Contains(HasSubstr("echoed gamma")));
  EXPECT_THAT(differs([](FireSettings& s) { s.range += 1e-9; }), Contains(HasSubstr("echoed range")));
  EXPECT_THAT(differs([](FireSettings& s) { s.gain_percent += 0.2; }), Contains(HasSubstr("echoed gain")));
  EXPECT_THAT(differs([](FireSettings& s) { s.sound_speed_mps = 1500; }), Contains(HasSubstr("echoed sound speed")));
  EXPECT_THAT(differs([](FireSettings& s) { s.salinity_ppt = 35; }), Contains(HasSubstr("echoed salinity")));
  EXPECT_THAT(differs([](FireSettings& s) { s.flags ^= 0x40; }), Contains(HasSubstr("echoed flags")));
  EXPECT_THAT(echo_violations(gains_fire, ping, "verbatim"), Contains(HasSubstr("echoed gain is 70, expected 50")));
}

TEST(Sequence, ReportsChangesOfIdsAndDevice) {
  const auto state = device();
  PingSequence sequence;
  EXPECT_THAT(sequence.add(answer(state, gains_fire, 1)), IsEmpty());
  EXPECT_THAT(sequence.add(answer(state, gains_fire, 2)), IsEmpty());
  EXPECT_THAT(sequence.add(answer(state, gains_fire, 5)), IsEmpty());
  EXPECT_EQ(sequence.skipped_ids(), 2u);
  EXPECT_THAT(sequence.add(answer(state, gains_fire, 5)), Contains("ping_id 5 does not rise above 5"));
  auto other = device();
  other.id = 9;
  EXPECT_THAT(sequence.add(answer(other, gains_fire, 6)), Contains("src_device_id is 9 but that of the ping before is 7001"));
}

TEST(Status, BrokenStatusMessagesAreReported) {
  const Bytes beacon = protocol::vendors().front()->beacon(device(), at(0));
  const auto after = [&](std::size_t offset, const char* bytes) {
    Bytes changed = beacon;
    overwrite(changed, offset, hex(bytes));
    return status_violations(decode_status(changed).value(), changed.size());
  };
  EXPECT_THAT(after(16, "01"), Contains(HasSubstr("src_device_id is 7001 but device_id")));
  EXPECT_THAT(after(24, "01"), Contains(HasSubstr("main firmware")));
  EXPECT_THAT(after(52, "00 00 00 00"), Contains("ip_addr is 0.0.0.0"));
  EXPECT_THAT(after(22, "01 00"), Contains(HasSubstr("part_number")));
  EXPECT_THAT(status_violations(decode_status(beacon).value(), 143), Contains(HasSubstr("datagram length is 143")));
}

TEST(Status, Bit7IsAnOption) {
  const auto status =
      decode_status(protocol::vendors().front()->beacon(device("oculus-m1200d", {{"status_bit7", "set"}}), at(0)));
  EXPECT_EQ(status->status, 0x83u);
}

}  // namespace
}  // namespace sonar::oculus::tests
