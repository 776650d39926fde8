// A packet of beam-formed data: head, data header, samples, foot. Little-endian.
// Layout: docs/protocols/m3.md; sources: protocol/m3/README.md.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/message_fields.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::m3 {

namespace means = protocol::means;

using wire::Bytes;
using wire::BytesView;

inline constexpr std::uint16_t tcp_port = 20001;
inline constexpr std::size_t most_beams = 1024;  // size of the table of directions

enum class DataType : std::uint16_t {
  complex_floats = 0x1002,  // I and Q of each sample, 32 bits each
};

inline constexpr std::uint16_t sync_word = 0x8000;
struct PacketHead {
  std::array<std::uint16_t, 4> sync{sync_word, sync_word, sync_word, sync_word};
  DataType type = DataType::complex_floats;
  std::uint16_t reserved = 0;
  std::array<std::uint32_t, 10> reserved_words{};
  std::uint32_t body_size = 0;  // data header and samples
};
constexpr void fields(auto& visit, wire::Like<PacketHead> auto& m) {
  visit("sync", m.sync, means::magic);
  visit("data_type", m.type, means::message_type);
  visit("reserved", m.reserved);
  visit("reserved_words", m.reserved_words);
  visit("body_size", m.body_size, means::payload_size);
}

struct PacketFoot {
  std::uint32_t body_size = 0;  // as in the head
  std::array<std::uint32_t, 10> reserved_words{};
};
constexpr void fields(auto& visit, wire::Like<PacketFoot> auto& m) {
  visit("body_size", m.body_size);
  visit("reserved_words", m.reserved_words);
}

/// Gain of the samples at range r [m]: a log10 r + b r / 1000 + c, at most `limit` [dB].
struct GainLaw {
  std::int16_t a = 20, b = 100;
  float c_db = -16, limit_db = 100;
};
constexpr void fields(auto& visit, wire::Like<GainLaw> auto& m) {
  visit("a", m.a);
  visit("b", m.b);
  visit("c", m.c_db, means::gain);
  visit("limit", m.limit_db);
}

/// The first part of the data header, up to the table of the beams' directions.
struct DataFront {
  std::uint32_t version = 14, sonar_id = 0;
  std::array<std::uint32_t, 8> sonar_info{};  // element 0: unknown, here the serial number
  std::uint32_t time_s = 0, time_ms = 0;      // UTC time at which the ping is fired
  float sound_speed_mps = 0;
  std::uint32_t samples = 0;        // samples in each beam
  float near_m = 0, far_m = 0;      // near and far range of the settings
  float start_s = 0, length_s = 0;  // sampling window; `start_s` counts from the start of the ping
  std::uint16_t beams = 0, processing = 0;
};
constexpr void fields(auto& visit, wire::Like<DataFront> auto& m) {
  visit("version", m.version, means::version);
  visit("sonar_id", m.sonar_id, means::source_id);
  visit("sonar_info", m.sonar_info, means::device_id);
  visit("time_s", m.time_s, means::time);
  visit("time_ms", m.time_ms);
  visit("sound_speed", m.sound_speed_mps, means::sound_speed);
  visit("samples", m.samples, means::rows);
  visit("near", m.near_m);
  visit("far", m.far_m, means::range);
  visit("window_start", m.start_s);
  visit("window_length", m.length_s);
  visit("beams", m.beams, means::beams);
  visit("processing", m.processing);
}

struct RotatorOffset {
  float a_m = 0, b_m = 0, r_m = 0, angle_deg = 0;
};
constexpr void fields(auto& visit, wire::Like<RotatorOffset> auto& m) {
  visit("a", m.a_m);
  visit("b", m.b_m);
  visit("r", m.r_m);
  visit("angle", m.angle_deg);
}

/// The rest of the data header: how the ping was made, attitude and position, and zeros up to 8512 bytes.
struct DataBack {
  float sample_interval_s = 0;
  std::uint16_t image_destination = 0;
  std::uint8_t pulse_type = 0, azimuth_processing = 1;
  std::uint32_t mode_id = 0;
  std::int32_t hybrid_pings = 1, hybrid_index = 0;
  std::uint16_t phase_length = 1, phase_index = 0, images = 1, image_index = 0;
  std::uint32_t frequency_hz = 0, pulse_us = 0, ping_number = 0;
  float filter_hz = 0, resolution_m = 0, ping_rate_hz = 0;
  std::array<char, 128> application{};
  std::array<char, 64> pulse_name{};
  GainLaw gain;
  float heading_deg = 0, magnetic_variation_deg = 0, pitch_deg = 0, roll_deg = 0, depth_m = 0, temperature_c = 0;
  std::array<float, 3> offset_m{}, rotation_deg{};  // mounting of the head: x to starboard, y ahead, z up
  std::uint32_t mounting = 0;                       // 0 = the head points ahead
  double latitude_deg = 0, longitude_deg = 0;
  float transmit_s = 0;  // start of the pulse, from the start of the ping
  std::uint8_t head_sensors = 1, head_status = 0, sound_speed_source = 1, time_mode = 1;
  float own_heading_deg = 0, own_pitch_deg = 0, own_roll_deg = 0;
  std::array<RotatorOffset, 3> rotators{};
  std::uint16_t first_element = 0, last_element = 63;
  std::array<char, 32> text_1{}, text_2{};
  float local_time_h = 0, speed_knots = 0, heave_m = 0, ping_near_m = 0, ping_far_m = 0, altitude_m = 0, geoid_m = 0;
  std::array<float, 4> sound_speeds{};  // measured, filtered, applied, threshold
  std::array<std::int8_t, 8> depth_tracking{100, 75, 1};
  std::array<std::uint8_t, 12> position_quality{};
  std::uint32_t scan_3d = 0, scan_axis = 0;
  std::uint8_t sonar_class = 17;
  std::array<std::uint8_t, 3> transmitters{};
  float vehicle_altitude_m = 0, conductivity = 0;
  std::array<std::uint8_t, 3796> reserved{};
};
constexpr void fields(auto& visit, wire::Like<DataBack> auto& m) {
  visit("sample_interval", m.sample_interval_s, means::range_resolution);
  visit("image_destination", m.image_destination);
  visit("pulse_type", m.pulse_type);
  visit("azimuth_processing", m.azimuth_processing);
  visit("mode_id", m.mode_id);
  visit("hybrid_pings", m.hybrid_pings);
  visit("hybrid_index", m.hybrid_index);
  visit("phase_length", m.phase_length);
  visit("phase_index", m.phase_index);
  visit("images", m.images);
  visit("image_index", m.image_index);
  visit("frequency", m.frequency_hz, means::frequency);
  visit("pulse_length", m.pulse_us);
  visit("ping_number", m.ping_number, means::ping_id);
  visit("filter_bandwidth", m.filter_hz);
  visit("resolution", m.resolution_m);
  visit("ping_rate", m.ping_rate_hz, means::ping_rate);
  visit("application", m.application);
  visit("pulse_name", m.pulse_name);
  visit("gain", m.gain);
  visit("heading", m.heading_deg, means::heading);
  visit("magnetic_variation", m.magnetic_variation_deg);
  visit("pitch", m.pitch_deg, means::pitch);
  visit("roll", m.roll_deg, means::roll);
  visit("depth", m.depth_m);
  visit("temperature", m.temperature_c, means::temperature);
  visit("offset", m.offset_m);
  visit("rotation", m.rotation_deg);
  visit("mounting", m.mounting);
  visit("latitude", m.latitude_deg);
  visit("longitude", m.longitude_deg);
  visit("transmit_start", m.transmit_s);
  visit("head_sensors", m.head_sensors);
  visit("head_status", m.head_status, means::device_status);
  visit("sound_speed_source", m.sound_speed_source);
  visit("time_mode", m.time_mode);
  visit("own_heading", m.own_heading_deg);
  visit("own_pitch", m.own_pitch_deg);
  visit("own_roll", m.own_roll_deg);
  visit("rotators", m.rotators);
  visit("first_element", m.first_element);
  visit("last_element", m.last_element);
  visit("text_1", m.text_1);
  visit("text_2", m.text_2);
  visit("local_time", m.local_time_h);
  visit("speed", m.speed_knots);
  visit("heave", m.heave_m);
  visit("ping_near", m.ping_near_m);
  visit("ping_far", m.ping_far_m);
  visit("altitude", m.altitude_m);
  visit("geoid_height", m.geoid_m);
  visit("sound_speeds", m.sound_speeds);
  visit("depth_tracking", m.depth_tracking);
  visit("position_quality", m.position_quality);
  visit("scan_3d", m.scan_3d);
  visit("scan_axis", m.scan_axis);
  visit("sonar_class", m.sonar_class);
  visit("transmitters", m.transmitters);
  visit("vehicle_altitude", m.vehicle_altitude_m);
  visit("conductivity", m.conductivity);
  visit("reserved", m.reserved);
}

struct DataHeader {
  DataFront front;
  std::array<float, most_beams> beam_deg{};  // the first `beams` elements are valid, in rising order
  DataBack back;
};
constexpr void fields(auto& visit, wire::Like<DataHeader> auto& m) {
  visit("front", m.front);
  visit("beam_angles", m.beam_deg);
  visit("back", m.back);
}

/// The part of a packet before the samples.
struct PacketFront {
  PacketHead head;
  DataHeader data;
};
constexpr void fields(auto& visit, wire::Like<PacketFront> auto& m) {
  visit("head", m.head);
  visit("data", m.data);
}

inline constexpr std::size_t head_size = wire::wire_size<PacketHead>(), data_header_size = wire::wire_size<DataHeader>(),
                             foot_size = wire::wire_size<PacketFoot>(), data_front_size = wire::wire_size<DataFront>(),
                             sample_size = 8;
static_assert(head_size == 56 && data_header_size == 8512 && foot_size == 44 && data_front_size == 76);
static_assert(wire::locate<DataHeader>(means::ping_id)->offset == 4208);
static_assert(wire::locate<DataHeader>(means::device_status)->offset == 4501);
inline constexpr std::size_t samples_at = head_size + data_header_size;

}  // namespace sonar::m3
