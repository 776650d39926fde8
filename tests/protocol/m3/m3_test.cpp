// Compares the emulated M3 with the published layout (bytes at the offsets of its tables) and with the sampling windows of real
// packets, and its host with packets that this file builds without our writer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "core/pipeline/arithmetic/receiver.hpp"
#include "protocol/m3/m3.hpp"
#include "protocol/m3/settings.hpp"

namespace sonar::m3 {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

protocol::DeviceState device(const char* positive_angles = "port") {
  protocol::DeviceState state;
  state.name = "front";
  state.id = 7001;
  state.model = models().front();
  state.water.sound_speed_mps = 1469;
  state.options = *protocol::check_options(vendor(), {{"positive_angles", positive_angles}});
  state.settings = vendor().initial_settings(state).vendor_settings;
  return state;
}

constexpr std::size_t beams = 128;

/// Returns a ping of zeros. In samples that set() writes, the code 2^22 is an amplitude of 1.
Ping ping_of(const protocol::DeviceState& state, const Settings& settings = {}) {
  Ping ping;
  PingRequest& r = ping.request;
  r.model = state.model;
  r.number = PingNumber{8722};
  r.fired_at = Time(1'699'948'686s) + 593ms;
  r.water.temperature_c = 30.75;
  const protocol::ChangeSettings change = change_to(settings, state);
  r.settings = change.settings;
  r.vendor_settings = change.vendor_settings;
  const std::size_t rows = static_cast<std::size_t>(r.settings.range_bin_count);
  ping.samples.resize(4 * beams * rows);
  ping.beam_signal_upa.resize(beams * rows);
  return ping;
}
void set(Ping& ping, std::size_t row, std::size_t beam, unsigned amplitude, std::complex<float> signal) {
  ping.samples[4 * (row * beams + beam) + 2] = static_cast<std::byte>(amplitude << 6 & 0xFF);
  ping.samples[4 * (row * beams + beam) + 3] = static_cast<std::byte>(amplitude >> 2);
  ping.beam_signal_upa[row * beams + beam] = signal;
}

std::uint64_t integer_at(BytesView bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::to_integer<std::uint64_t>(bytes[at + i]) << (8 * i);
  return value;
}
float float_at(BytesView bytes, std::size_t at) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(integer_at(bytes, at, 4)));
}
std::string text_at(BytesView bytes, std::size_t at) { return reinterpret_cast<const char*>(bytes.data() + at); }

TEST(M3Packets, HaveFieldsAtTheOffsetsOfTheTables) {
  const protocol::DeviceState state = device();
  const Bytes packet = encode_packet(ping_of(state), state);
  constexpr std::size_t body = 8512 + 8 * 128 * 1372, data = 56;
  ASSERT_EQ(packet.size(), 56 + body + 44);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(integer_at(packet, 2 * i, 2), 0x8000u);
  EXPECT_EQ(integer_at(packet, 8, 2), 0x1002u);
  EXPECT_EQ(integer_at(packet, 52, 4), body);
  EXPECT_EQ(integer_at(packet, 56 + body, 4), body);
  for (const auto& [at, value] : {std::pair<std::size_t, std::uint64_t>{0, 14},
                                  {8, 7001},
                                  {40, 1'699'948'686},
                                  {44, 593},
                                  {52, 1372},
                                  {4180, 118},
                                  {4184, 1},
                                  {4200, 500000},
                                  {4204, 20},
                                  {4208, 8722}})
    EXPECT_EQ(integer_at(packet, data + at, 4), value) << at;
  EXPECT_EQ(integer_at(packet, data + 72, 2), 128u);
  EXPECT_EQ(integer_at(packet, data + 4566, 2), 63u);
  EXPECT_EQ(integer_at(packet, data + 4416, 2), 20u);
  EXPECT_EQ(integer_at(packet, data + 4418, 2), 100u);
  for (const auto& [at, value] : {std::pair<std::size_t, double>{48, 1469},
                                  {56, 0.2},
                                  {60, 10},
                                  {64, 0.000281},
                                  {68, 0.014049},
                                  {76, -59.53125},
                                  {80, -58.59375},
                                  {76 + 4 * 127, 59.53125},
                                  {76 + 4 * 128, 0},
                                  {4172, 10.24e-6},
                                  {4212, 48828.125},
                                  {4216, 0.0145},
                                  {4220, 15},
                                  {4420, -16},
                                  {4424, 100},
                                  {4448, 30.75},
                                  {4496, 25e-6},
                                  {4648, 10}})
    EXPECT_NEAR(float_at(packet, data + at), value, 3e-7 + 1e-6 * std::abs(value)) << at;
  EXPECT_EQ(text_at(packet, data + 4224), "Imaging 3");
  EXPECT_EQ(text_at(packet, data + 4352), "'Tone Burst 20us'");
}

TEST(M3Packets, HoldBeamsFromTheLeastAngleAndPhasesOfTheirSignals) {
  for (const bool to_port : {true, false}) {
    const protocol::DeviceState state = device(to_port ? "port" : "starboard");
    Ping ping = ping_of(state);
    set(ping, 5, 0, 3, {0, 0.25f});  // the outermost beam to port
    set(ping, 7, 127, 10, {-30, 40});
    const Bytes packet = encode_packet(ping, state);
    const auto sample = [&](std::size_t beam, std::size_t row) {
      const std::size_t at = 56 + 8512 + 8 * (beam * 1372 + row);
      return std::complex<float>(float_at(packet, at), float_at(packet, at + 4));
    };
    const std::complex<float> port = sample(to_port ? 127 : 0, 5), starboard = sample(to_port ? 0 : 127, 7);
    EXPECT_NEAR(port.real(), 0, 1e-5);
    EXPECT_NEAR(port.imag(), 3, 1e-5);
    EXPECT_NEAR(starboard.real(), -6, 1e-5);
    EXPECT_NEAR(starboard.imag(), 8, 1e-5);
    EXPECT_EQ(sample(1, 5), std::complex<float>(0, 0));
  }
}

TEST(M3Packets, HaveNoPhaseIfThePingHasNoSignals) {
  const protocol::DeviceState state = device();
  Ping ping = ping_of(state);
  set(ping, 5, 127, 3, {0, 1});
  ping.beam_signal_upa.clear();
  const Bytes packet = encode_packet(ping, state);
  EXPECT_NEAR(float_at(packet, 56 + 8512 + 8 * 5), 3, 1e-5);
  EXPECT_EQ(float_at(packet, 56 + 8512 + 8 * 5 + 4), 0);
}

/// The expected values are from headers of real packets. Times are in seconds after the start of the ping.
TEST(M3Windows, AreThoseOfRealPackets) {
  const Window one = window_of(1, 10), two = window_of(0.2, 10), three = window_of(0.4, 20);
  EXPECT_NEAR(one.start_s + transmit_s, 0.001307, 1e-9);
  EXPECT_EQ(one.samples, 1272);
  EXPECT_NEAR(one.samples * one.interval_s, 0.013024, 2e-6);
  EXPECT_NEAR(two.start_s + transmit_s, 0.000281, 1e-9);
  EXPECT_EQ(two.samples, 1372);
  EXPECT_NEAR(two.samples * two.interval_s, 0.014049, 2e-6);
  EXPECT_NEAR(three.start_s + transmit_s, 0.000538, 1e-9);
  EXPECT_NEAR(three.interval_s, 20.48e-6, 1e-12);
  EXPECT_NEAR(three.samples, 1373, 1);
}

TEST(M3Settings, FollowTheGainLawAndTheWater) {
  const protocol::DeviceState state = device();
  const PingSettings s = change_to({}, state).settings;
  EXPECT_NEAR(s.device_sound_speed_mps, 1469, 1e-3);
  EXPECT_NEAR(s.range_of_row(0), 1469 * 0.000256 / 2, 1e-6);
  EXPECT_NEAR(s.range_of_row(1000) - s.range_of_row(0), 1000 * 1469 * 10.24e-6 / 2, 1e-6);
  const double gain_db = tvg_db(models().front()->modes.front().receiver, 10, static_cast<double>(s.device_absorption_db_per_m)) +
                         static_cast<double>(s.gain_db);
  EXPECT_NEAR(gain_db, 20 + 100 * 10 / 1000.0 - 16, 1e-4);
  EXPECT_NEAR(vendor().gain_percent(state), 50, 1e-6);
}

TEST(M3Settings, AreRefusedIfTheProductLacksThem) {
  const auto refusal = [](const protocol::SettingsOverride& wanted) {
    const auto change = apply_override(wanted, device());
    return change ? "accepted" : change.error().text;
  };
  EXPECT_THAT(refusal({.range_m = 151, .rate_hz = {}, .gain_percent = {}, .mode = {}, .beams = {}}), HasSubstr("1 to 150 m"));
  EXPECT_THAT(refusal({.range_m = {}, .rate_hz = 41, .gain_percent = {}, .mode = {}, .beams = {}}),
              HasSubstr("the rate of an M3 is 0 to 40 Hz, not 41 Hz"));
  EXPECT_THAT(refusal({.range_m = {}, .rate_hz = {}, .gain_percent = 101, .mode = {}, .beams = {}}), HasSubstr("0 to 100"));
  EXPECT_THAT(refusal({.range_m = {}, .rate_hz = {}, .gain_percent = {}, .mode = 1, .beams = {}}), HasSubstr("one mode"));
  EXPECT_THAT(refusal({.range_m = {}, .rate_hz = {}, .gain_percent = {}, .mode = {}, .beams = 64}), HasSubstr("128 beams"));
  EXPECT_EQ(refusal({.range_m = 150, .rate_hz = 0, .gain_percent = 0, .mode = 0, .beams = 128}), "accepted");
}

/// A packet of 3 beams of 2 samples, typed by hand (docs/protocols/m3.md).
class Typed {
 public:
  Typed() : bytes_(56 + 8512 + 8 * 3 * 2 + 44) {
    for (std::size_t i = 0; i < 4; ++i) put(2 * i, 0x8000, 2);
    put(8, 0x1002, 2);
    put(52, 8512 + 48, 4);
    put(56 + 8512 + 48, 8512 + 48, 4);
    put(56 + 40, 1'700'000'000, 4);
    put(56 + 44, 250, 4);
    put(56 + 48, 1500.0f);
    put(56 + 52, 2, 4);
    put(56 + 64, 0.001025f);
    put(56 + 72, 3, 2);
    for (std::size_t i = 0; i < 3; ++i) put(56 + 76 + 4 * i, static_cast<float>(i) * 10 - 10);
    put(56 + 4172, 0.0001f);
    put(56 + 4200, 500000, 4);
    put(56 + 4208, 17, 4);
    put(56 + 4496, 0.000025f);
    put(56 + 8512 + 8 * 4, 3.0f);  // the first sample of the last beam
    put(56 + 8512 + 8 * 4 + 4, -4.0f);
  }
  void put(std::size_t at, std::uint64_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) bytes_[at + i] = static_cast<std::byte>(value >> (8 * i));
  }
  void put(std::size_t at, float value) { put(at, std::bit_cast<std::uint32_t>(value), 4); }
  const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

std::vector<protocol::HostPing> pings_in(BytesView bytes) {
  const auto host = *make_host({});
  std::vector<protocol::HostPing> pings;
  for (protocol::HostAction& action : host->on_bytes(0, bytes, Time{}))
    if (auto* ping = std::get_if<protocol::HostPing>(&action)) pings.push_back(std::move(*ping));
  return pings;
}

TEST(M3Host, ReadsATypedPacket) {
  const auto pings = pings_in(Typed().bytes());
  ASSERT_EQ(pings.size(), 1u);
  const protocol::PingFacts& facts = pings[0].facts;
  EXPECT_EQ(facts.number, 17u);
  EXPECT_EQ(facts.beams, 3u);
  EXPECT_EQ(facts.rows, 2u);
  EXPECT_NEAR(facts.row_m, 0.075, 1e-6);
  EXPECT_NEAR(facts.range_m, 0.75 + 2 * 0.075, 1e-6);
  EXPECT_NEAR(*pings[0].fired_s, 1'700'000'000.25, 1e-6);
  const auto picture = pings[0].picture();
  ASSERT_TRUE(picture) << picture.error().text;
  EXPECT_NEAR(picture->start_m, 0.75 - 0.0375, 1e-6) << "samples are in the middle of rows";
  EXPECT_NEAR(picture->azimuth_rad[0], 10 * pi / 180, 1e-6) << "positive angles are to port";
  EXPECT_THAT(picture->samples, testing::ElementsAre(5, 0, 0, 0, 0, 0)) << "sqrt(I^2 + Q^2)";
}

TEST(M3Host, RefusesPacketsThatContradictThemselves) {
  for (const auto& [at, size] :
       {std::pair<std::size_t, std::size_t>{2, 2}, {8, 2}, {52, 4}, {56 + 52, 4}, {56 + 72, 2}, {56 + 8512 + 48, 4}}) {
    Typed typed;
    typed.put(at, 77, size);
    EXPECT_TRUE(pings_in(typed.bytes()).empty()) << at;
  }
  Typed falling;
  falling.put(56 + 76, 20.0f);
  const auto pings = pings_in(falling.bytes());
  ASSERT_EQ(pings.size(), 1u);
  EXPECT_THAT(pings[0].errors, testing::ElementsAre(HasSubstr("do not rise")));
  EXPECT_FALSE(pings[0].picture());
}

TEST(M3Host, RefusesAllSettings) {
  protocol::Wanted wanted;
  wanted.settings.range_m = 5;
  const auto host = make_host(wanted);
  ASSERT_FALSE(host);
  EXPECT_THAT(host.error().text,
              HasSubstr("--range does not apply to an M3, whose drivers set nothing: use `sonarctl set sonar`"));
}

}  // namespace
}  // namespace sonar::m3
