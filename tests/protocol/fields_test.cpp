// Tests that Vendor::field() finds each field by its meaning: an encoded message must have the right value at that place.
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <set>

#include "protocol/oculus/encode_ping.hpp"
#include "tests/protocol/blueview/blueview_testing.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::fields_test {
namespace {
using protocol::Field;
using protocol::FieldName;
using protocol::Part;
using protocol::Region;
using Place = std::pair<std::size_t, std::size_t>;

/// Reads a little-endian value without the decoder under test.
double value_at(wire::BytesView message, const Field& field) {
  std::uint64_t bits = 0;
  for (std::size_t i = field.size; i > 0; --i) bits = bits << 8 | std::to_integer<std::uint64_t>(message[field.offset + i - 1]);
  if (field.type == Field::Type::integer) return static_cast<double>(bits);
  if (field.size == 4) {
    const auto half = static_cast<std::uint32_t>(bits);
    float value = 0;
    std::memcpy(&value, &half, sizeof value);
    return static_cast<double>(value);
  }
  double value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}
wire::Bytes bytes_at(wire::BytesView message, const Field& field) {
  const wire::BytesView bytes = message.subspan(field.offset, field.size);
  return {bytes.begin(), bytes.end()};
}

/// Checks that exactly the fields in `expected` are found, with their values, and that a field is not found in a message that
/// ends before it.
void expect_fields(const protocol::Vendor& vendor, Part part, wire::BytesView message,
                   const std::map<FieldName, double>& expected, const std::set<FieldName>& of_bytes = {}) {
  for (std::size_t i = 0; i < protocol::field_names.size(); ++i) {
    const auto name = static_cast<FieldName>(i);
    const auto found = vendor.field(part, name, message);
    const auto value = expected.find(name);
    ASSERT_EQ(found.has_value(), value != expected.end() || of_bytes.contains(name)) << protocol::field_names[i];
    if (!found) continue;
    EXPECT_FALSE(vendor.field(part, name, message.first(found->offset + found->size - 1))) << protocol::field_names[i];
    EXPECT_EQ(found->type == Field::Type::bytes, of_bytes.contains(name)) << protocol::field_names[i];
    if (value == expected.end()) continue;
    EXPECT_EQ(value_at(message, *found), value->second) << protocol::field_names[i];
  }
}

wire::Bytes oculus_ping(int version) {
  using namespace oculus;
  PingHead head;
  head.fixed.header = {magic, 7001, 9, {}, static_cast<std::uint16_t>(version), 0, 5};
  head.fixed.fire = {.ping_rate = PingRate::hz40, .range = 3.5, .gain_percent = 60};
  head.fixed.ping_id = 77, head.fixed.status = 2;
  head.fixed.frequency_hz = 2.1e6, head.fixed.temperature_c = 12.5, head.fixed.pressure_bar = 1.5;
  head.fixed.heading_deg = 90, head.fixed.pitch_deg = -4, head.fixed.roll_deg = 3;
  head.fixed.sound_speed_mps = 1480, head.fixed.ping_start_time_s = 12.25, head.ping_start_counter = 1225;
  head.fixed.data_size = DataSize::bits16, head.fixed.range_resolution_m = 0.25;
  head.fixed.row_count = 2, head.fixed.beam_count = 3;
  const std::array<std::int16_t, 3> bearings{-100, 0, 100};
  const wire::Bytes samples(12, std::byte{8});
  return encode_ping(head, {bearings, {}, samples});
}

TEST(Fields, AnOculusPingOfEachVersionHasItsFields) {
  const protocol::Vendor& vendor = *protocol::vendors().front();
  for (const int version : {0, 1, 2}) {
    std::map<FieldName, double> expected{{FieldName::magic, 0x4F53},
                                         {FieldName::source_id, 7001},
                                         {FieldName::destination_id, 9},
                                         {FieldName::message_type, 0x23},
                                         {FieldName::version, version},
                                         {FieldName::payload_size, 2048 + 12 - 16},
                                         {FieldName::part_number, 5},
                                         {FieldName::ping_id, 77},
                                         {FieldName::ping_status, 2},
                                         {FieldName::frequency, 2.1e6},
                                         {FieldName::temperature, 12.5},
                                         {FieldName::pressure, 1.5},
                                         {FieldName::sound_speed, 1480},
                                         {FieldName::time, version == 2 ? 12.25 : 1225},
                                         {FieldName::sample_type, 1},
                                         {FieldName::range_resolution, 0.25},
                                         {FieldName::rows, 2},
                                         {FieldName::beams, 3},
                                         {FieldName::image_offset, 2048},
                                         {FieldName::image_size, 12},
                                         {FieldName::message_size, 2048 + 12},
                                         {FieldName::range, 3.5},
                                         {FieldName::ping_rate, 2},
                                         {FieldName::gain, 60}};
    if (version == 2) expected.insert({{FieldName::heading, 90}, {FieldName::pitch, -4}, {FieldName::roll, 3}});
    SCOPED_TRACE(version);
    expect_fields(vendor, Part::ping, oculus_ping(version), expected);
  }
  EXPECT_EQ(vendor.field(Part::ping, FieldName::heading, {}), vendor.field(Part::ping, FieldName::heading, oculus_ping(2)));
}

TEST(Fields, AnOculusStatusHasItsFields) {
  protocol::DeviceState state = oculus::tests::device();
  state.water.temperature_c = 12.25;
  state.connected_client = {10, 0, 0, 7};
  const wire::Bytes status = oculus::make_status(state);
  const auto decoded = oculus::decode_status(status);
  ASSERT_TRUE(decoded);
  expect_fields(*protocol::vendors().front(), Part::beacon, status,
                {{FieldName::magic, 0x4F53},
                 {FieldName::source_id, 7001},
                 {FieldName::destination_id, 0},
                 {FieldName::message_type, 1},
                 {FieldName::version, decoded->header.version},
                 {FieldName::payload_size, 126},
                 {FieldName::device_id, 7001},
                 {FieldName::part_number, 1042},
                 {FieldName::device_status, 3},
                 {FieldName::temperature, 12.25},
                 {FieldName::pressure, decoded->pressure_bar}},
                {FieldName::firmware, FieldName::address, FieldName::netmask, FieldName::connected_address, FieldName::mac});
  const auto bytes = [&](FieldName name) {
    return bytes_at(status, *protocol::vendors().front()->field(Part::beacon, name, status));
  };
  using oculus::tests::hex;
  EXPECT_EQ(bytes(FieldName::firmware), hex("00 00 00 01 00 00 00 00 00 00 00 01 00 00 00 00 00 00 00 01 00 00 00 00"));
  EXPECT_EQ(bytes(FieldName::address), hex("C0 A8 01 02"));
  EXPECT_EQ(bytes(FieldName::netmask), hex("FF FF FF 00"));
  EXPECT_EQ(bytes(FieldName::connected_address), hex("0A 00 00 07"));
  EXPECT_EQ(bytes(FieldName::mac), hex("02 00 00 00 1B 59"));
}

TEST(Fields, AnOculusPingHasItsRegions) {
  const protocol::Vendor& vendor = *protocol::vendors().front();
  for (const auto& [version, fixed_size] : {std::pair{1, std::size_t{122}}, {2, std::size_t{202}}}) {
    const wire::Bytes ping = oculus_ping(version);
    EXPECT_EQ(vendor.region(Region::header, ping), (Place{0, 16}));
    EXPECT_EQ(vendor.region(Region::metadata, ping), (Place{16, fixed_size - 16}));
    EXPECT_EQ(vendor.region(Region::bearings, ping), (Place{fixed_size, 6}));
    EXPECT_EQ(vendor.region(Region::image, ping), (Place{2048, 12}));
    EXPECT_FALSE(vendor.region(Region::image, wire::BytesView(ping).first(ping.size() - 1)));
    EXPECT_FALSE(vendor.region(Region::metadata, wire::BytesView(ping).first(fixed_size - 1)));
    EXPECT_EQ(vendor.region(Region::header, wire::BytesView(ping).first(16)), (Place{0, 16}));
  }
  for (const Region region : {Region::header, Region::metadata, Region::bearings, Region::image})
    EXPECT_EQ(vendor.region(region, {}), Place{});
}

/// Returns header and payload of a ping, as a host receives them.
wire::Bytes blueview_ping(const protocol::DeviceState& device) {
  Ping ping;
  ping.request.model = device.model;
  ping.request.settings = blueview::vendor().initial_settings(device).settings;
  ping.request.number = PingNumber(42);
  ping.request.fired_at = blueview::test::at_s(0.5);
  const PingSettings& s = ping.request.settings;
  ping.samples.resize(std::size_t{2} * static_cast<std::size_t>(s.range_bin_count * s.beam_count));
  return blueview::make_frame(blueview::FrameType::ping_data, 3, *blueview::vendor().frame(ping, device));
}

TEST(Fields, ABlueViewPingHasItsFields) {
  const protocol::DeviceState device = blueview::test::device();
  const wire::Bytes message = blueview_ping(device);
  const auto image = blueview::vendor().region(Region::image, message);
  ASSERT_TRUE(image);
  const std::size_t bins = image->second / 2 / 512;
  const std::map<FieldName, double> expected{
      {FieldName::message_type, 0x8004},
      {FieldName::payload_size, static_cast<double>(message.size() - 16)},
      {FieldName::source_id, 0},
      {FieldName::ping_id, 42},
      {FieldName::time, 1.7e9 + 0.5},
      {FieldName::range, static_cast<double>(static_cast<float>(2 + static_cast<double>(bins) * 0.0254))},
      {FieldName::sound_speed, 1500},
      {FieldName::range_resolution, static_cast<double>(0.0254f)},
      {FieldName::beams, 512},
      {FieldName::rows, static_cast<double>(bins)},
      {FieldName::sample_type, 1},
      {FieldName::heading, 90},
      {FieldName::pitch, 0},
      {FieldName::roll, 0},
      {FieldName::image_size, static_cast<double>(image->second)}};
  expect_fields(blueview::vendor(), Part::ping, message, expected, {FieldName::magic});
  EXPECT_EQ(bytes_at(message, *blueview::vendor().field(Part::ping, FieldName::magic, message)),
            oculus::tests::hex("42 56 45 31"));
  EXPECT_TRUE(blueview::vendor().field(Part::ping, FieldName::rows, {}));
  EXPECT_FALSE(blueview::vendor().field(Part::beacon, FieldName::magic, {}));
}

TEST(Fields, ABlueViewPingHasItsRegions) {
  const wire::Bytes message = blueview_ping(blueview::test::device());
  const protocol::Vendor& vendor = blueview::vendor();
  EXPECT_EQ(vendor.region(Region::header, message), (Place{0, 16}));
  EXPECT_EQ(vendor.region(Region::metadata, message), (Place{16, 80}));
  EXPECT_EQ(vendor.region(Region::image, message), (Place{96, message.size() - 96}));
  EXPECT_FALSE(vendor.region(Region::bearings, message));
  EXPECT_FALSE(vendor.region(Region::bearings, {}));
  EXPECT_EQ(vendor.region(Region::image, {}), Place{});
  EXPECT_FALSE(vendor.region(Region::metadata, wire::BytesView(message).first(95)));
}

}  // namespace
}  // namespace sonar::fields_test
