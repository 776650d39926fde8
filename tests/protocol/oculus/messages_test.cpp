// Compares every message with bytes that were typed field by field from the published layouts, in both directions.
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

// The defaults of ENS: mode 2, 10 Hz, 255 Mbit/s, gamma 127, flags 0x0D, 2.54 m, 50 %. Addressed to the captured device, 7892.
const Bytes fire_v0_bytes =
    hex("53 4F  00 00  D4 1E  15 00  00 00  25 00 00 00  00 00 "  // header, payload 37, addressed to 7892
        "02 00 FF 7F 0D "                                         // mode, rate, network, gamma, flags
        "52 B8 1E 85 EB 51 04 40 "                                // range 2.54
        "00 00 00 00 00 00 49 40 "                                // gain 50
        "00 00 00 00 00 70 97 40 "                                // sound speed 1500
        "00 00 00 00 00 80 41 40");                               // salinity 35

// A fire message of liboculus: version 2, payload 73, 32-bit data.
const Bytes fire_v2_bytes =
    hex("53 4F  00 00  00 00  15 00  02 00  49 00 00 00  00 00 "
        "02 02 FF 7F 4F "
        "00 00 00 00 00 00 10 40 "  // range 4
        "00 00 00 00 00 00 49 40 "
        "00 00 00 00 00 00 00 00 "
        "00 00 00 00 00 00 00 00 "
        "00 02 00 00  01 00 00 00  02 00 00 00 "  // ext flags, reserved
        "03 00 00 00 "                            // beacon locator frequency
        "04 00 00 00 05 00 00 00 06 00 00 00 07 00 00 00 08 00 00 00");

TEST(Messages, FireVersion0ByHand) {
  ASSERT_EQ(fire_v0_bytes.size(), 53u);
  const auto fire = parse_fire(fire_v0_bytes);
  ASSERT_TRUE(fire.has_value());
  EXPECT_EQ(fire->version, 0);
  EXPECT_EQ(fire->settings.mode, 2);
  EXPECT_EQ(fire->settings.ping_rate, PingRate::hz10);
  EXPECT_EQ(fire->settings.network_speed, 255);
  EXPECT_EQ(fire->settings.gamma, 127);
  EXPECT_EQ(fire->settings.flags, 0x0D);
  EXPECT_EQ(fire->settings.range, 2.54);
  EXPECT_EQ(fire->settings.gain_percent, 50);
  EXPECT_EQ(fire->settings.sound_speed_mps, 1500);
  EXPECT_EQ(fire->settings.salinity_ppt, 35);
  EXPECT_EQ(make_fire(*fire, 7892), fire_v0_bytes);
}

TEST(Messages, FireVersion2ByHand) {
  ASSERT_EQ(fire_v2_bytes.size(), 89u);
  const auto fire = parse_fire(fire_v2_bytes);
  ASSERT_TRUE(fire.has_value());
  EXPECT_EQ(fire->version, 2);
  EXPECT_EQ(fire->settings.ping_rate, PingRate::hz40);
  EXPECT_EQ(fire->extension.flags, 0x200u);
  EXPECT_EQ(fire->extension.reserved0, (std::array<std::uint32_t, 2>{1, 2}));
  EXPECT_EQ(fire->extension.beacon_locator_frequency, 3u);
  EXPECT_EQ(fire->extension.reserved1, (std::array<std::uint32_t, 5>{4, 5, 6, 7, 8}));
  EXPECT_EQ(make_fire(*fire), fire_v2_bytes);
}

// Several clients leave the payload size 0.
TEST(Messages, FireMayLeaveItsPayloadSizeZero) {
  Bytes zeroed = fire_v0_bytes;
  overwrite(zeroed, 10, hex("00 00 00 00"));
  EXPECT_EQ(make_fire(*parse_fire(zeroed), 7892, true), zeroed);
}

TEST(Messages, FireVersion2MayLackItsTail) {
  const auto fire = parse_fire(BytesView(fire_v2_bytes).first(61));
  ASSERT_TRUE(fire.has_value());
  EXPECT_EQ(fire->extension.flags, 0x200u);
  EXPECT_EQ(fire->extension.reserved0, (std::array<std::uint32_t, 2>{1, 0}));
  EXPECT_FALSE(parse_fire(BytesView(fire_v2_bytes).first(52)).has_value());
}

const Bytes status_bytes =
    hex("53 4F  59 1B  00 00  01 00  00 00  7E 00 00 00  12 04 "  // payload 126, part number 1042
        "59 1B 00 00  01 00  12 04  03 00 00 00 "                 // device 7001, imaging, part, main firmware
        "00 00 00 01  00 00 00 00  00 00 00 01  00 00 00 00  00 00 00 01  00 00 00 00 "
        "C0 A8 01 02  FF FF FF 00  0A 00 00 07 "  // addresses as read
        "02 00 00 00 1B 59 "
        "00 00 00 00 00 80 28 40  00 00 00 00 00 80 28 40  00 00 00 00 00 80 28 40  00 00 00 00 00 80 28 40 "
        "00 00 00 00 00 80 28 40  00 00 00 00 00 80 28 40  00 00 00 00 00 80 28 40  00 00 00 00 00 80 28 40 ");

TEST(Messages, StatusByHand) {
  protocol::DeviceState state = device();
  state.connected_client = {10, 0, 0, 7};
  state.water.temperature_c = 12.25;
  const Bytes beacon = protocol::vendors().front()->beacon(state, at(0));
  ASSERT_EQ(beacon.size(), 142u);
  ASSERT_EQ(status_bytes.size(), 134u);
  EXPECT_EQ(Bytes(beacon.begin(), beacon.begin() + 134), status_bytes);
  const auto status = decode_status(beacon);
  ASSERT_TRUE(status.has_value());
  EXPECT_NEAR(status->pressure_bar, 1.013 + 0.0981 * 5, 0.002);  // absolute pressure at 5 m in fresh water
  EXPECT_THAT(status_violations(*status, beacon.size()), ::testing::IsEmpty());
}

TEST(Messages, HandTypedStatusIsRead) {
  const auto status = decode_status(joined({status_bytes, hex("00 00 00 00 00 00 F4 3F")}));
  ASSERT_TRUE(status.has_value());
  EXPECT_EQ(status->device_id, 7001u);
  EXPECT_EQ(status->part_number, 1042);
  EXPECT_EQ(status->status, 3u);
  EXPECT_EQ(status->ip_address, (std::array<std::uint8_t, 4>{192, 168, 1, 2}));
  EXPECT_EQ(status->connected_ip, (std::array<std::uint8_t, 4>{10, 0, 0, 7}));
  EXPECT_EQ(status->mac[5], 0x59);
  EXPECT_EQ(status->temperature_c[6], 12.25);
  EXPECT_EQ(status->pressure_bar, 1.25);
}

TEST(Messages, ShortOrForeignStatusIsRefused) {
  const Bytes whole = joined({status_bytes, hex("00 00 00 00 00 00 F4 3F")});
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_FALSE(decode_status(Exact(BytesView(whole).first(length)).view()).has_value()) << length;
  Bytes foreign = whole;
  foreign[0] = std::byte{0};
  EXPECT_FALSE(decode_status(foreign).has_value());
}

// One ping of 2 beams and 3 rows with row gains, as the published layout has it.
const Bytes echo_bytes =
    hex("02 C3 19 7F 1D "  // mode 2, the captured rate 195, flags with gains
        "00 00 00 00 00 00 04 40  00 00 00 00 00 00 49 40  00 00 00 00 00 4A 97 40  00 00 00 00 00 00 00 00 ");
const Bytes head_bytes =
    hex("63 56 06 00  00 00 00 00  00 00 00 40 60 03 40 41  00 00 00 00 00 80 28 40  00 00 00 00 00 00 F4 3F ");
const Bytes bearing_and_image_sizes = hex("02 00  03 00 00 00");
const Bytes image_bytes = hex("01 00 00 00 0A 0B  02 00 00 00 14 15  00 01 00 00 FE 00");

Bytes ping_v1_by_hand() {
  Bytes bytes = joined({hex("53 4F  D4 1E  00 00  23 00  00 00  02 08 00 00  00 00 "), echo_bytes, head_bytes,
                        hex("00 00 00 00 00 4A 97 40 "                // speed of sound used 1490.5
                            "80 A9 01 B9 "                            // start counter 0xB901A980
                            "00  00 00 00 00 00 00 D0 3F "            // 8 bit, 0.25 m per row
                            "03 00 02 00 "                            // 3 rows, 2 beams
                            "00 08 00 00  12 00 00 00  12 08 00 00 "  // offset 2048, image 18, message 2066
                            "48 F4  B8 0B")});                        // -3000, +3000
  bytes.resize(2048);
  return joined({bytes, image_bytes});
}

Bytes ping_v2_by_hand() {
  Bytes bytes = joined({hex("53 4F  D4 1E  00 00  23 00  02 00  02 08 00 00  00 00 "), echo_bytes,
                        hex("00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00  "
                            "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "),
                        head_bytes,
                        hex("00 00 00 00 00 E8 70 40  00 00 00 00 00 00 0C C0  00 00 00 00 00 00 11 40 "  // 270.5, -3.5, 4.25
                            "00 00 00 00 00 4A 97 40 "
                            "0B 0B EE 07 3C DD 5E 40 "  // 123.456789 s
                            "00  00 00 00 00 00 00 D0 3F  03 00 02 00 "
                            "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
                            "00 08 00 00  12 00 00 00  12 08 00 00 "
                            "48 F4  B8 0B")});
  bytes.resize(2048);
  return joined({bytes, image_bytes});
}

void expect_common_fields(const DecodedPing& ping) {
  const PingResultV2& fixed = ping.head.fixed;
  EXPECT_THAT(ping.violations, ::testing::IsEmpty());
  EXPECT_EQ(fixed.header.source, 7892);
  EXPECT_EQ(static_cast<int>(fixed.fire.ping_rate), 195);
  EXPECT_EQ(fixed.fire.network_speed, 25);
  EXPECT_EQ(fixed.fire.range, 2.5);
  EXPECT_EQ(fixed.ping_id, 415331u);
  EXPECT_EQ(fixed.frequency_hz, 2098880.5);
  EXPECT_EQ(fixed.temperature_c, 12.25);
  EXPECT_EQ(fixed.pressure_bar, 1.25);
  EXPECT_EQ(fixed.sound_speed_mps, 1490.5);
  EXPECT_EQ(fixed.range_resolution_m, 0.25);
  EXPECT_EQ(ping.rows(), 3u);
  EXPECT_EQ(ping.beams(), 2u);
  EXPECT_EQ(ping.bearings_cdeg, (std::vector<std::int16_t>{-3000, 3000}));
  EXPECT_EQ(ping.row_gains, (std::vector<std::uint32_t>{1, 2, 256}));
  EXPECT_EQ(ping.sample(1, 1), 0x15u);
  EXPECT_EQ(ping.sample(2, 0), 254u);
  EXPECT_NEAR(ping.azimuth_rad(0), rad_from_deg(30), 1e-12) << "negative bearings are to port";
  EXPECT_DOUBLE_EQ(ping.row_range_m(2), 0.625);
}

Bytes encoded_again(const DecodedPing& ping) {
  Bytes samples;
  for (std::size_t row = 0; row < ping.rows(); ++row)
    samples.insert(samples.end(), ping.row_samples(row).begin(), ping.row_samples(row).end());
  return encode_ping(ping.head, {ping.bearings_cdeg, ping.row_gains, samples});
}

TEST(Messages, PingVersion1ByHand) {
  const Bytes bytes = ping_v1_by_hand();
  ASSERT_EQ(bytes.size(), 2066u);
  const auto ping = decode_ping(bytes);
  ASSERT_TRUE(ping.has_value());
  expect_common_fields(*ping);
  EXPECT_EQ(ping->head.ping_start_counter, 3103893888u);
  EXPECT_EQ(encoded_again(*ping), bytes);
}

TEST(Messages, PingVersion2ByHand) {
  const Bytes bytes = ping_v2_by_hand();
  ASSERT_EQ(bytes.size(), 2066u);
  const auto ping = decode_ping(bytes);
  ASSERT_TRUE(ping.has_value());
  expect_common_fields(*ping);
  EXPECT_EQ(ping->head.fixed.heading_deg, 270.5);
  EXPECT_EQ(ping->head.fixed.pitch_deg, -3.5);
  EXPECT_EQ(ping->head.fixed.roll_deg, 4.25);
  EXPECT_EQ(ping->head.fixed.ping_start_time_s, 123.456789);
  EXPECT_EQ(encoded_again(*ping), bytes);
}

TEST(Messages, DummyByHand) {
  const Bytes bytes = hex("53 4F  59 1B  00 00  FF 00  00 00  00 00 00 00  00 00");
  const auto state = device();
  const auto dialogue = protocol::vendors().front()->converse({}, state, at(0));
  const auto reaction = dialogue->on_tick(dialogue->next_tick(), false);
  ASSERT_EQ(reaction.replies.size(), 1u);
  EXPECT_EQ(reaction.replies[0], bytes);
  const auto received = decode_message(bytes);
  ASSERT_TRUE(std::holds_alternative<DummyMessage>(received));
  EXPECT_EQ(std::get<DummyMessage>(received).header.source, 7001);
}

// The first octet is in the most significant byte: 192.168.1.2 is 0xC0A80102, which is the bytes 02 01 A8 C0.
TEST(Messages, UserConfigByHand) {
  const Bytes bytes = hex("53 4F  59 1B  00 00  55 00  00 00  0C 00 00 00  00 00  02 01 A8 C0  00 FF FF FF  01 00 00 00");
  const auto received = decode_message(bytes);
  ASSERT_TRUE(std::holds_alternative<UserConfigMessage>(received));
  const auto& config = std::get<UserConfigMessage>(received);
  EXPECT_EQ(config.ip_address, 0xC0A80102u);
  EXPECT_EQ(config.ip_mask, 0xFFFFFF00u);
  EXPECT_EQ(config.dhcp_enable, 1u);
  EXPECT_EQ(wire::bytes_of(config), bytes);
}

TEST(Messages, LogByHand) {
  const Bytes bytes = hex("53 4F  59 1B  00 00  80 00  00 00  05 00 00 00  00 00  62 6F 6F 74 0A");
  const auto received = decode_message(bytes);
  ASSERT_TRUE(std::holds_alternative<LogText>(received));
  EXPECT_EQ(std::get<LogText>(received).text, "boot\n");
}

}  // namespace
}  // namespace sonar::oculus::tests
