// The packets of a Norbit, little-endian: bathymetry (port 2210) and water column (2211). Sources: protocol/norbit/README.md.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "protocol/message_fields.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::norbit {

namespace means = protocol::means;

using wire::Bytes;
using wire::BytesView;

inline constexpr std::uint16_t command_port = 2209, bathymetry_port = 2210, column_port = 2211;

enum class Type : std::uint32_t { bathymetry = 1, column = 2 };
enum class PixelType : std::uint32_t { uint16 = 2, int16 = 3 };  // other values exist

inline constexpr std::uint32_t preamble = 0xDEADBEEF, version = 4;
struct Header {
  std::uint32_t start = preamble;
  Type type{};
  std::uint32_t size = 0;  // size of the packet, including this header
  std::uint32_t version = norbit::version, reserved = 0;
  std::uint32_t crc = 0;  // checksum of everything after the header
};
constexpr void fields(auto& visit, wire::Like<Header> auto& m) {
  visit("preamble", m.start, means::magic);
  visit("type", m.type, means::message_type);
  visit("size", m.size, means::message_size);
  visit("version", m.version, means::version);
  visit("reserved", m.reserved);
  visit("crc", m.crc);
}

inline constexpr float not_measured = std::numeric_limits<float>::quiet_NaN();

/// Start of a bathymetry packet. Angles are in radians and increase from port to starboard.
struct BathymetryFront {
  float sound_mps = 0, sample_hz = 0;
  std::uint32_t beams = 0, ping = 0;
  double time_s = 0, network_time_s = 0;  // UNIX time of the transmission
  float rate_hz = 0;
  std::uint16_t kind = 4;
  std::uint8_t beam_mode = 2, sonar_mode = 1;  // beam_mode 2: 256 beams, equally spaced in angle
  std::array<std::uint16_t, 4> reserved{};
  float tilt_rad = 0, gain = 1, frequency_hz = 0, bandwidth_hz = 0, pulse_s = 0, reserved_2 = 0, voltage = not_measured,
        swath_middle_rad = 0, swath_rad = 0, gate_tilt_rad = 0;
};
constexpr void fields(auto& visit, wire::Like<BathymetryFront> auto& m) {
  visit("snd_velocity", m.sound_mps, means::sound_speed);
  visit("sample_rate", m.sample_hz, means::range_resolution);
  visit("N", m.beams, means::beams);
  visit("ping_number", m.ping, means::ping_id);
  visit("time", m.time_s, means::time);
  visit("time_net", m.network_time_s);
  visit("ping_rate", m.rate_hz, means::ping_rate);
  visit("bathy_type", m.kind);
  visit("beam_dist_mode", m.beam_mode);
  visit("sonar_mode", m.sonar_mode);
  visit("reserved1", m.reserved);
  visit("tx_angle", m.tilt_rad);
  visit("gain", m.gain, means::gain);
  visit("tx_freq", m.frequency_hz, means::frequency);
  visit("tx_bw", m.bandwidth_hz);
  visit("tx_len", m.pulse_s);
  visit("reserved2", m.reserved_2);
  visit("tx_voltage", m.voltage);
  visit("swath_dir", m.swath_middle_rad);
  visit("swath_open", m.swath_rad);
  visit("gate_tilt", m.gate_tilt_rad);
}

namespace quality {
inline constexpr std::uint8_t signal_to_noise = 1, no_flyer = 2;
}

struct Beam {
  std::uint32_t sample = 0;  // sample number of the bottom; 0 = no bottom
  float angle_rad = 0;
  std::uint16_t upper_gate = 0, lower_gate = 0;  // samples
  float intensity = 0;                           // without the gain
  std::uint16_t flags = 0;
  std::uint8_t quality_flag = 0, quality_value = 0;
};
constexpr void fields(auto& visit, wire::Like<Beam> auto& m) {
  visit("sample_number", m.sample);
  visit("angle", m.angle_rad);
  visit("upper_gate", m.upper_gate);
  visit("lower_gate", m.lower_gate);
  visit("intensity", m.intensity);
  visit("flags", m.flags);
  visit("quality_flag", m.quality_flag);
  visit("quality_val", m.quality_value);
}

/// The analog gain is g1 up to sample t1, g2 from t2 on, and linear in dB between them.
struct ColumnFront {
  float sound_mps = 0, sample_hz = 0;
  std::uint32_t beams = 0, samples = 0;  // samples of a beam
  double time_s = 0;
  PixelType pixels = PixelType::int16;
  std::int32_t first_sample = 0;
  float gain = 1;
  std::uint32_t reserved_1 = 0;
  float swath_middle_rad = 0, swath_rad = 0, frequency_khz = 0, bandwidth_khz = 0, pulse_s = 0;
  std::uint32_t amplitude = 15;
  std::array<std::uint32_t, 3> reserved_2{};
  float rate_hz = 0, reserved_3 = 0;
  std::uint32_t ping = 0;
  double network_time_s = 0;
  std::uint32_t formed_beams = 0;
  std::int32_t gain_begin = 0;  // t1
  float gain_begin_db = 0;
  std::int32_t gain_end = 0;  // t2
  float gain_end_db = 0;
  std::array<std::uint16_t, 2> reserved_4{};
  float tilt_rad = 0, voltage = not_measured;
  std::uint8_t beam_mode = 2, sonar_mode = 1;
  std::uint16_t reserved_5 = 0;
  float gate_tilt_rad = 0, reserved_6 = 0;
  std::array<std::uint8_t, 28> reserved_7{};
};
constexpr void fields(auto& visit, wire::Like<ColumnFront> auto& m) {
  visit("snd_velocity", m.sound_mps, means::sound_speed);
  visit("sample_rate", m.sample_hz, means::range_resolution);
  visit("N", m.beams, means::beams);
  visit("M", m.samples, means::rows);
  visit("time", m.time_s, means::time);
  visit("dtype", m.pixels, means::sample_type);
  visit("t0", m.first_sample);
  visit("gain", m.gain, means::gain);
  visit("reserved1", m.reserved_1);
  visit("swath_dir", m.swath_middle_rad);
  visit("swath_open", m.swath_rad);
  visit("tx_freq", m.frequency_khz, means::frequency);
  visit("tx_bw", m.bandwidth_khz);
  visit("tx_len", m.pulse_s);
  visit("tx_amp", m.amplitude);
  visit("reserved2", m.reserved_2);
  visit("ping_rate", m.rate_hz, means::ping_rate);
  visit("reserved3", m.reserved_3);
  visit("ping_number", m.ping, means::ping_id);
  visit("time_net", m.network_time_s);
  visit("beams", m.formed_beams);
  visit("vga_t1", m.gain_begin);
  visit("vga_g1", m.gain_begin_db);
  visit("vga_t2", m.gain_end);
  visit("vga_g2", m.gain_end_db);
  visit("reserved4", m.reserved_4);
  visit("tx_angle", m.tilt_rad);
  visit("tx_voltage", m.voltage);
  visit("beam_dist_mode", m.beam_mode);
  visit("sonar_mode", m.sonar_mode);
  visit("reserved5", m.reserved_5);
  visit("gate_tilt", m.gate_tilt_rad);
  visit("reserved6", m.reserved_6);
  visit("reserved7", m.reserved_7);
}

inline constexpr std::size_t header_size = wire::wire_size<Header>(), beam_size = wire::wire_size<Beam>(),
                             bathymetry_front_size = wire::wire_size<BathymetryFront>(),
                             column_front_size = wire::wire_size<ColumnFront>(), pixel_size = 2;
static_assert(header_size == 24 && bathymetry_front_size == 88 && beam_size == 20 && column_front_size == 168);
static_assert(header_size + wire::locate<ColumnFront>(means::ping_id)->offset == 108);
static_assert(header_size + wire::locate<BathymetryFront>(means::frequency)->offset == 80);

}  // namespace sonar::norbit
