// The messages that only an S500 has; messages.hpp has the common messages.
#pragma once

#include "protocol/ping/messages.hpp"

namespace sonar::ping {

struct SetPingParams {
  std::uint32_t start_mm = 0, length_mm = 5000;  // length 0: automatic
  std::int16_t gain = -1, period_ms = -1;        // gain -1: automatic; period -1: a single ping
  std::uint16_t pulse_us = 0;                    // ignored, because the device chooses it
  Id report{};                                   // message that the device sends for each ping; 0: no pings
  std::uint16_t reserved = 0;
  std::uint8_t chirp = 0, decimation = 0;
  bool operator==(const SetPingParams&) const = default;
};
constexpr void fields(auto& visit, wire::Like<SetPingParams> auto& m) {
  visit("start_mm", m.start_mm);
  visit("length_mm", m.length_mm);
  visit("gain_index", m.gain);
  visit("msec_per_ping", m.period_ms);
  visit("pulse_len_usec", m.pulse_us);
  visit("report_id", m.report);
  visit("reserved", m.reserved);
  visit("chirp", m.chirp);
  visit("decimation", m.decimation);
}

struct Distance2 {
  std::uint32_t ping_mm = 0, averaged_mm = 0;
  std::uint16_t reserved = 0;
  std::uint8_t ping_confidence = 0, averaged_confidence = 0;
  std::uint32_t power_up_ms = 0;
};
constexpr void fields(auto& visit, wire::Like<Distance2> auto& m) {
  visit("ping_distance_mm", m.ping_mm);
  visit("averaged_distance_mm", m.averaged_mm);
  visit("reserved", m.reserved);
  visit("ping_confidence", m.ping_confidence);
  visit("average_distance_confidence", m.averaged_confidence);
  visit("timestamp", m.power_up_ms);
}

/// The profile of a ping; `results` powers follow, of which 0 to 65535 mean lowest_db to highest_db.
struct Profile6 {
  std::uint32_t ping = 0, start_mm = 0, length_mm = 0, start_hz = 0, end_hz = 0, sampling_hz = 0, power_up_ms = 0, spare = 0;
  float pulse_s = 0, analog_gain = 0, highest_db = 0, lowest_db = 0, depth_m = 0, smooth_depth_m = 0, spare2 = 0;
  std::uint8_t confidence = 0, gain = 0, decimation = 0, smooth_confidence = 0;
  std::uint16_t results = 0;
};
constexpr void fields(auto& visit, wire::Like<Profile6> auto& m) {
  visit("ping_number", m.ping, means::ping_id);
  visit("start_mm", m.start_mm);
  visit("length_mm", m.length_mm, means::range);
  visit("start_ping_hz", m.start_hz, means::frequency);
  visit("end_ping_hz", m.end_hz);
  visit("adc_sample_hz", m.sampling_hz);
  visit("timestamp_msec", m.power_up_ms, means::time);
  visit("spare2", m.spare);
  visit("pulse_duration_sec", m.pulse_s);
  visit("analog_gain", m.analog_gain);
  visit("max_pwr_db", m.highest_db);
  visit("min_pwr_db", m.lowest_db);
  visit("this_ping_depth_m", m.depth_m);
  visit("smooth_depth_m", m.smooth_depth_m);
  visit("fspare2", m.spare2);
  visit("ping_depth_measurement_confidence", m.confidence);
  visit("gain_index", m.gain, means::gain);
  visit("decimation", m.decimation);
  visit("smoothed_depth_measurement_confidence", m.smooth_confidence);
  visit("num_results", m.results, means::rows);
}

static_assert(wire::wire_size<SetPingParams>() == 20 && wire::wire_size<Distance2>() == 16 && wire::wire_size<Profile6>() == 66);

}  // namespace sonar::ping
