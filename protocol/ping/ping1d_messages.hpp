// The messages that only a Ping1D has; messages.hpp has the common messages. Messages that contain a single number have no
// struct.
#pragma once

#include "protocol/ping/messages.hpp"

namespace sonar::ping {

/// The range, which a host sets and the device reports.
struct ScanRange {
  std::uint32_t start_mm = 0, length_mm = 0;
};
constexpr void fields(auto& visit, wire::Like<ScanRange> auto& m) {
  visit("scan_start", m.start_mm);
  visit("scan_length", m.length_mm);
}

struct FirmwareVersion {
  std::uint8_t type = 1, model = 1;
  std::uint16_t major = 0, minor = 0;
};
constexpr void fields(auto& visit, wire::Like<FirmwareVersion> auto& m) {
  visit("device_type", m.type);
  visit("device_model", m.model);
  visit("firmware_version_major", m.major);
  visit("firmware_version_minor", m.minor);
}

struct GeneralInfo {
  std::uint16_t major = 0, minor = 0, voltage_mv = 0, interval_ms = 0;
  std::uint8_t gain = 0, mode_auto = 0;
};
constexpr void fields(auto& visit, wire::Like<GeneralInfo> auto& m) {
  visit("firmware_version_major", m.major);
  visit("firmware_version_minor", m.minor);
  visit("voltage_5", m.voltage_mv);
  visit("ping_interval", m.interval_ms);
  visit("gain_setting", m.gain);
  visit("mode_auto", m.mode_auto);
}

struct DistanceSimple {
  std::uint32_t distance_mm = 0;
  std::uint8_t confidence = 0;
};
constexpr void fields(auto& visit, wire::Like<DistanceSimple> auto& m) {
  visit("distance", m.distance_mm);
  visit("confidence", m.confidence);
}

struct Distance {
  std::uint32_t distance_mm = 0;
  std::uint16_t confidence = 0, transmit_us = 0;
  std::uint32_t ping = 0, start_mm = 0, length_mm = 0, gain = 0;
};
constexpr void fields(auto& visit, wire::Like<Distance> auto& m) {
  visit("distance", m.distance_mm);
  visit("confidence", m.confidence);
  visit("transmit_duration", m.transmit_us);
  visit("ping_number", m.ping, means::ping_id);
  visit("scan_start", m.start_mm);
  visit("scan_length", m.length_mm, means::range);
  visit("gain_setting", m.gain, means::gain);
}

/// The distance, and the profile of the ping; `count` strengths of one byte each follow.
struct Profile : Distance {
  std::uint16_t count = 0;
};
template <class V, wire::Like<Profile> M>
constexpr void fields(V& visit, M& m) {
  fields(visit, static_cast<std::conditional_t<std::is_const_v<M>, const Distance, Distance>&>(m));
  visit("profile_data_length", m.count, means::rows);
}

static_assert(wire::wire_size<DistanceSimple>() == 5 && wire::wire_size<Distance>() == 24 && wire::wire_size<Profile>() == 26);
static_assert(wire::wire_size<FirmwareVersion>() == 6 && wire::wire_size<GeneralInfo>() == 10);

}  // namespace sonar::ping
