// Tests frames: the order of the channels, header fields at the vendor's offsets, and frames assembled from their datagrams.
#include <cstring>
#include <numeric>

#include "tests/protocol/aris/aris_testing.hpp"

namespace sonar::aris {
namespace {

TEST(ArisOrder, ChannelsOfTheFirstPingAreInTheOrderOfTheDigitiser) {
  // One sample of 48 beams, three pings: channel 0 of ping 0 is beam 30, channel 5 is beam 0.
  Bytes picture(48);
  for (std::size_t beam = 0; beam < 48; ++beam) picture[beam] = static_cast<std::byte>(beam);
  const Bytes raw = raw_from_picture(picture, 1, 3);
  EXPECT_EQ(Bytes(raw.begin(), raw.begin() + 16), tests::hex("1E 06 2A 12 18 00 24 0C 21 09 2D 15 1B 03 27 0F"));
  EXPECT_EQ(raw[16], std::byte{31}) << "channel 0 of the second ping";
}

TEST(ArisOrder, IsUndoneInEveryMode) {
  for (const int pings : {3, 4, 6, 8}) {
    Bytes picture(static_cast<std::size_t>(pings) * 16 * 37);
    for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = static_cast<std::byte>(i * 31 + i / 256);
    const Bytes raw = raw_from_picture(picture, 37, pings);
    EXPECT_NE(raw, picture);
    EXPECT_EQ(picture_from_raw(raw, 37, pings), picture);
  }
}

Ping ping_of(const protocol::DeviceState& device, const Settings& settings, std::uint32_t number) {
  Ping ping;
  ping.request.model = device.model;
  ping.request.settings = ping_settings(settings, device);
  ping.request.vendor_settings = std::make_shared<HeldSettings>(settings);
  ping.request.number = PingNumber(number);
  ping.request.fired_at = tests::at_s(0.5);
  ping.request.water = device.water;
  ping.request.sonar_in_world.position_m = {0, 0, -10};
  const PingSettings& s = ping.request.settings;
  ping.samples.resize(static_cast<std::size_t>(s.range_bin_count * s.beam_count));
  for (std::size_t i = 0; i < ping.samples.size(); ++i)
    ping.samples[i] = static_cast<std::byte>(i % 128);  // the code is our number of the beam
  return ping;
}

TEST(ArisFrame, HeaderFieldsAreAtTheVendorsOffsets) {
  auto state = tests::device();
  Settings s = initial_settings(state);
  s.first_ping = 40;
  s.clock_offset = std::chrono::seconds(100);
  s.telephoto = true;  // no effect: an ARIS 3000 has no such lens
  apply(s, tests::acoustics(9), state);
  const auto datagrams = vendor().datagrams(vendor().ports()[2], ping_of(state, s, 42), state);
  FramePart part;
  ASSERT_TRUE(protobuf::read(datagrams.at(0), part));
  EXPECT_EQ(part.frame_index, 2) << "frames are counted from the connection on";
  ASSERT_TRUE(part.header);
  const auto read = [&](std::size_t at, auto value) {
    std::memcpy(&value, part.header->data() + at, sizeof value);
    return value;
  };
  const auto u32 = [&](std::size_t at) { return read(at, std::uint32_t{}); };
  const auto f32 = [&](std::size_t at) { return read(at, float{}); };
  EXPECT_EQ(u32(0), 1u);
  EXPECT_EQ(read(4, std::uint64_t{}), 1700000100500000u);
  EXPECT_EQ(u32(12), 0x05464444u);
  EXPECT_EQ(read(20, std::uint64_t{}), 1700000100500000u);
  const double c = static_cast<double>(f32(464));
  EXPECT_NEAR(c, sound_speed_mps(12, 35, 0), 0.01);
  EXPECT_NEAR(f32(52), 1360e-6 * c / 2, 1e-5);
  EXPECT_NEAR(f32(56), 3200e-6 * c / 2, 1e-5);
  EXPECT_EQ(u32(68), 12u);
  EXPECT_EQ(f32(224), 12);
  EXPECT_TRUE(std::isnan(f32(244)) && std::isnan(f32(248)) && std::isnan(f32(252)) && std::isnan(f32(632)));
  EXPECT_EQ(f32(420), 250000);
  EXPECT_EQ(f32(432), -1) << "level";
  EXPECT_EQ(u32(436), 9u);
  EXPECT_EQ(u32(440), 1u);
  EXPECT_EQ(u32(444), 6u);
  EXPECT_EQ(u32(448), 4920u);
  EXPECT_EQ(u32(452), 4u);
  EXPECT_EQ(u32(456), 1u);
  EXPECT_EQ(f32(460), 12);
  EXPECT_EQ(u32(468), 800u);
  EXPECT_EQ(u32(476), 1360u);
  EXPECT_EQ(u32(484), 1u);
  EXPECT_EQ(u32(488), 7001u);
  EXPECT_EQ(u32(508), 8711u);
  EXPECT_EQ(u32(480), 0u);
  EXPECT_EQ(u32(516), 0u);
  EXPECT_EQ(u32(520), 35u);
  EXPECT_NEAR((f32(524) - 14.6959f) * 0.702398f, 10, 1e-3) << "clients compute the depth from the pressure";
  EXPECT_EQ(u32(680), 9u);
  EXPECT_EQ(u32(700), static_cast<std::uint32_t>(1.7e9));
}

TEST(ArisFrame, IsAssembledFromPartsInAnyOrder) {
  for (const char* reordered : {"false", "true"}) {
    auto state = tests::device("aris-3000", {{"reordered", reordered}});
    Settings s = initial_settings(state);
    apply(s, tests::acoustics(), state);
    auto datagrams = vendor().datagrams(vendor().ports()[2], ping_of(state, s, 1), state);
    std::rotate(datagrams.begin(), datagrams.begin() + 5, datagrams.end());
    datagrams.insert(datagrams.begin() + 3, datagrams[2]);
    FrameAssembler assembler;
    std::optional<DecodedFrame> frame;
    for (const Bytes& datagram : datagrams)
      if (auto whole = assembler.add(datagram)) frame = std::move(whole);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, 1);
    EXPECT_EQ(frame->beams, 128u);
    EXPECT_EQ(frame->samples, 800u);
    for (std::size_t beam = 0; beam < 128; ++beam)
      EXPECT_EQ(frame->picture[5 * 128 + beam], static_cast<std::byte>(127 - beam)) << "beam 0 is the right-most";
    EXPECT_EQ(assembler.incomplete(), 0u);
  }
}

TEST(ArisFrame, WithoutAPartIsIncomplete) {
  const auto state = tests::device();
  Settings s = initial_settings(state);
  apply(s, tests::acoustics(), state);
  FrameAssembler assembler;
  auto datagrams = vendor().datagrams(vendor().ports()[2], ping_of(state, s, 1), state);
  datagrams.erase(datagrams.begin() + 4);
  for (const Bytes& datagram : datagrams) EXPECT_FALSE(assembler.add(datagram));
  int whole = 0;
  for (const Bytes& datagram : vendor().datagrams(vendor().ports()[2], ping_of(state, s, 2), state))
    whole += assembler.add(datagram) ? 1 : 0;
  EXPECT_EQ(whole, 1);
  EXPECT_EQ(assembler.incomplete(), 1u);
  EXPECT_FALSE(assembler.add(tests::hex("08 01 10 FF FF FF FF 07"))) << "a size that no frame has";
  EXPECT_FALSE(assembler.add({}));
}

TEST(ArisFrame, TheFirstPartHasFieldsAndRegions) {
  const auto state = tests::device();
  Settings s = initial_settings(state);
  apply(s, tests::acoustics(), state);
  const Bytes first = vendor().datagrams(vendor().ports()[2], ping_of(state, s, 1), state).at(0);
  const auto rows = vendor().field(protocol::Part::ping, protocol::FieldName::rows, first);
  ASSERT_TRUE(rows);
  std::uint32_t value = 0;
  std::memcpy(&value, first.data() + rows->offset, sizeof value);
  EXPECT_EQ(value, 800u);
  const auto header = vendor().region(protocol::Region::metadata, first), image = vendor().region(protocol::Region::image, first);
  ASSERT_TRUE(header && image);
  EXPECT_EQ(header->second, 744u);
  EXPECT_EQ(image->second, 620u);
  EXPECT_EQ(image->first, header->first + 744 + 3) << "after its field number and length";
  EXPECT_FALSE(vendor().region(protocol::Region::bearings, first));
  EXPECT_FALSE(vendor().field(protocol::Part::beacon, protocol::FieldName::magic, {}));
  EXPECT_FALSE(vendor().field(protocol::Part::ping, protocol::FieldName::rows, BytesView(first).first(100)));
}

TEST(ArisFrame, OlderFirmwareAndLongerDatagramsAreOptions) {
  const auto state = tests::device("aris-3000", {{"header_bytes", "700"}, {"datagram_bytes", "9000"}});
  Settings s = initial_settings(state);
  apply(s, tests::acoustics(9), state);
  const Ping ping = ping_of(state, s, 1);
  FrameAssembler assembler;
  std::optional<DecodedFrame> frame;
  std::size_t longest = 0;
  for (const Bytes& datagram : vendor().datagrams(vendor().ports()[2], ping, state)) {
    FramePart part;
    ASSERT_TRUE(protobuf::read(datagram, part));
    EXPECT_TRUE(!part.header || part.header->size() == 700u);
    longest = std::max(longest, datagram.size());
    if (auto whole = assembler.add(datagram)) frame = std::move(whole);
  }
  EXPECT_GT(longest, 8900u);
  EXPECT_LE(longest, 9000u);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header.applied_cookie, 9u);
  EXPECT_EQ(frame->header.go_time_us, 0u) << "older firmware lacks this field";
}

TEST(ArisFrame, TheHeaderStatesTheTelephotoLens) {
  const auto state = tests::device("aris-1800");
  Settings s = initial_settings(state);
  s.telephoto = true;
  Acoustics a = tests::acoustics(9);
  a.ping_mode = 3;
  a.cycle_us = 6000;
  a.frame_rate_hz = 8;
  ASSERT_EQ(apply(s, a, state).refusal, "");
  const Ping ping = ping_of(state, s, 1);
  FrameAssembler assembler;
  std::optional<DecodedFrame> frame;
  for (const Bytes& datagram : vendor().datagrams(vendor().ports()[2], ping, state))
    if (auto whole = assembler.add(datagram)) frame = std::move(whole);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header.large_lens, 1u);
  EXPECT_EQ(frame->beams, 96u);
  const FrequencyMode& mode = state.model->modes[static_cast<std::size_t>(ping.request.settings.mode)];
  EXPECT_NEAR(mode.beam_azimuths_rad.front(), 7.42 * 3.14159265 / 180, 0.001)
      << "with the telephoto lens the fan is half as wide";
}

}  // namespace
}  // namespace sonar::aris
