// The messages that only an Omniscan 450 has; messages.hpp has the common messages.
#pragma once

#include "protocol/ping/messages.hpp"

namespace sonar::ping {

struct OsPingParams {
  std::uint32_t start_mm = 0, length_mm = 5000, period_ms = 0;  // period 0 = the shortest that the range allows
  std::array<float, 2> reserved0{};
  float pulse_part = 0.002f, filter_part = 0.0015f;  // as fractions of the duration of a ping
  std::int16_t gain = -1;
  std::uint16_t results = 600;
  std::uint8_t enable = 0, reserved1 = 0;  // newer definitions add two bytes without meaning
  bool operator==(const OsPingParams&) const = default;
};
constexpr void fields(auto& visit, wire::Like<OsPingParams> auto& m) {
  visit("start_mm", m.start_mm);
  visit("length_mm", m.length_mm);
  visit("msec_per_ping", m.period_ms);
  visit("reserved_1", m.reserved0);
  visit("pulse_len_percent", m.pulse_part);
  visit("filter_duration_percent", m.filter_part);
  visit("gain_index", m.gain);
  visit("num_results", m.results);
  visit("enable", m.enable);
  visit("reserved_3", m.reserved1);
}

/// The profile of a ping; `results` powers follow, of which 0 to 65535 mean lowest_db to highest_db.
struct OsMonoProfile {
  std::uint32_t ping = 0, start_mm = 0, length_mm = 0, power_up_ms = 0, hz = 0;
  std::uint16_t gain = 0, results = 0, speed_dmps = 0;  // tenths of a metre per second
  std::uint8_t channel = 0, reserved = 0;
  float pulse_s = 0, analog_gain = 0, highest_db = 0, lowest_db = 0, transducer_heading_deg = 0, vehicle_heading_deg = 0;
};
constexpr void fields(auto& visit, wire::Like<OsMonoProfile> auto& m) {
  visit("ping_number", m.ping, means::ping_id);
  visit("start_mm", m.start_mm);
  visit("length_mm", m.length_mm, means::range);
  visit("timestamp_ms", m.power_up_ms, means::time);
  visit("ping_hz", m.hz, means::frequency);
  visit("gain_index", m.gain, means::gain);
  visit("num_results", m.results, means::rows);
  visit("sos_dmps", m.speed_dmps, means::sound_speed);
  visit("channel_number", m.channel);
  visit("reserved", m.reserved);
  visit("pulse_duration_sec", m.pulse_s);
  visit("analog_gain", m.analog_gain);
  visit("max_pwr_db", m.highest_db);
  visit("min_pwr_db", m.lowest_db);
  visit("transducer_heading_deg", m.transducer_heading_deg, means::heading);
  visit("vehicle_heading_deg", m.vehicle_heading_deg);
}

struct SoundSpeed {
  std::uint32_t mm_per_s = 1500000;
};
constexpr void fields(auto& visit, wire::Like<SoundSpeed> auto& m) { visit("speed_of_sound", m.mm_per_s); }

}  // namespace sonar::ping
