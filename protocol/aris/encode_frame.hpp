// Converts a Ping to the datagrams of a frame (header, order of channels, parts), and datagrams to a frame.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "protocol/aris/settings.hpp"
#include "protocol/message_fields.hpp"
#include "protocol/vendor.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::aris {

// The header of a frame, described once with the vendor's names. It is little-endian and packed, and has 744 bytes; recordings
// pad it to 1024.

namespace means = protocol::means;

inline constexpr std::uint32_t file_version = 0x05464444;  // "DDF", 5
inline constexpr std::size_t padded_header_size = 1024;

struct FrameHeader {
  static constexpr float no_axis = std::numeric_limits<float>::quiet_NaN();  // position of a missing rotator or arm
  std::uint32_t frame_index = 0;
  std::uint64_t frame_time_us = 0;  // time since 1970
  std::uint32_t version = file_version, status = 0;
  std::uint64_t sonar_time_us = 0;
  std::array<std::uint32_t, 6> calendar{};
  float window_start_m = 0, window_length_m = 0;
  std::array<std::uint32_t, 2> threshold_intensity{};
  std::uint32_t receiver_gain_db = 0, cpu_c = 30, psu_c = 31, humidity_percent = 20, focus = 0, battery = 0;
  std::array<float, 8> user{};
  std::array<float, 9> motion{};  // velocity, depth, altitude, pitch, pitch rate, roll, roll rate, heading, heading rate
  float compass_heading_deg = 0, compass_pitch_deg = 0, compass_roll_deg = 0;
  double latitude_deg = 0, longitude_deg = 0;
  float sonar_position = 0;
  std::uint32_t config_flags = 0;
  std::array<float, 3> target{};  // beam tilt, target range, target bearing
  std::array<std::uint32_t, 4> target_flags{};
  float water_c = 0;
  std::uint32_t timer_period = 0;
  std::array<float, 3> sonar_xyz{};
  float pan_deg = no_axis, tilt_deg = no_axis, roll_deg = no_axis;
  std::array<float, 3> pan_tilt_roll_north{};
  double vehicle_time_s = 0;
  std::array<std::uint32_t, 14> gps{};
  std::array<float, 6> offsets{};
  std::array<float, 16> matrix{};
  float sample_rate_hz = 0;
  std::array<float, 3> acceleration_g{};
  std::uint32_t ping_mode = 0, frequency = 0, pulse_us = 0, cycle_us = 0, sample_period_us = 0, transmit = 0;
  float frame_rate_hz = 0, sound_speed_mps = 0;
  std::uint32_t samples_per_beam = 0, high_voltage = 0, start_delay_us = 0, large_lens = 0, system = 0, serial = 0;
  std::uint64_t encrypted_key = 0;
  std::uint32_t error_flags = 0, missed_packets = 0, app_version = 8711, available2 = 0, reordered = 0, salinity = 0;
  float pressure_psi = 0, battery_mv = 0, main_mv = 0, switched_mv = 0;
  std::uint32_t focus_motor_moving = 0, voltage_changing = 0;
  std::array<std::uint32_t, 3> focus_faults{};  // time-out, over-current, not found
  std::uint32_t focus_stalled = 0;
  std::array<std::uint32_t, 10> faults{};  // FPGA time-out, busy, stuck; CPU, PSU, water, humidity, pressure, voltage read, write
  std::uint32_t focus_position = 0;
  std::array<float, 3> rotator_targets{};
  std::array<std::uint32_t, 3> rotator_errors{};
  std::array<float, 3> arm_positions{no_axis, no_axis, no_axis};
  std::array<float, 9> rotator_accelerations{};
  std::uint32_t applied_cookie = 0, constrained_cookie = 0, invalid_cookie = 0;
  std::uint32_t interpacket_delay = 0, interpacket_delay_us = 0, uptime_s = 0;
  std::uint16_t app_major = 2, app_minor = 8;
  std::uint64_t go_time_us = 0;
  std::array<float, 3> rotator_velocities{};
  std::uint32_t gps_age = 0, system_variant = 0, compass_revision = 1, reserved = 0;
};
constexpr void fields(auto& visit, wire::Like<FrameHeader> auto& m) {
  visit("FrameIndex", m.frame_index);
  visit("FrameTime", m.frame_time_us, means::time);
  visit("Version", m.version, means::version);
  visit("Status", m.status);
  visit("sonarTimeStamp", m.sonar_time_us);
  visit("calendar", m.calendar);
  visit("WindowStart", m.window_start_m);
  visit("WindowLength", m.window_length_m, means::range);
  visit("ThresholdIntensity", m.threshold_intensity);
  visit("ReceiverGain", m.receiver_gain_db, means::gain);
  visit("DegC1", m.cpu_c);
  visit("DegC2", m.psu_c);
  visit("Humidity", m.humidity_percent);
  visit("Focus", m.focus);
  visit("Battery", m.battery);
  visit("UserValues", m.user);
  visit("Motion", m.motion);
  visit("CompassHeading", m.compass_heading_deg, means::heading);
  visit("CompassPitch", m.compass_pitch_deg, means::pitch);
  visit("CompassRoll", m.compass_roll_deg, means::roll);
  visit("Latitude", m.latitude_deg);
  visit("Longitude", m.longitude_deg);
  visit("SonarPosition", m.sonar_position);
  visit("ConfigFlags", m.config_flags);
  visit("Target", m.target);
  visit("TargetFlags", m.target_flags);
  visit("WaterTemp", m.water_c, means::temperature);
  visit("TimerPeriod", m.timer_period);
  visit("SonarXYZ", m.sonar_xyz);
  visit("SonarPan", m.pan_deg);
  visit("SonarTilt", m.tilt_deg);
  visit("SonarRoll", m.roll_deg);
  visit("NorthPanTiltRoll", m.pan_tilt_roll_north);
  visit("VehicleTime", m.vehicle_time_s);
  visit("Gps", m.gps);
  visit("SonarOffsets", m.offsets);
  visit("Matrix", m.matrix);
  visit("SampleRate", m.sample_rate_hz);
  visit("Accell", m.acceleration_g);
  visit("PingMode", m.ping_mode, means::beams);
  visit("FrequencyHiLow", m.frequency);
  visit("PulseWidth", m.pulse_us);
  visit("CyclePeriod", m.cycle_us);
  visit("SamplePeriod", m.sample_period_us);
  visit("TransmitEnable", m.transmit);
  visit("FrameRate", m.frame_rate_hz, means::ping_rate);
  visit("SoundSpeed", m.sound_speed_mps, means::sound_speed);
  visit("SamplesPerBeam", m.samples_per_beam, means::rows);
  visit("Enable150V", m.high_voltage);
  visit("SampleStartDelay", m.start_delay_us);
  visit("LargeLens", m.large_lens);
  visit("TheSystemType", m.system);
  visit("SonarSerialNumber", m.serial, means::source_id);
  visit("EncryptedKey", m.encrypted_key);
  visit("ErrorFlags", m.error_flags);
  visit("MissedPackets", m.missed_packets);
  visit("ArisAppVersion", m.app_version);
  visit("Available2", m.available2);
  visit("ReorderedSamples", m.reordered, means::sample_type);
  visit("Salinity", m.salinity);
  visit("Pressure", m.pressure_psi, means::pressure);
  visit("BatteryVoltage", m.battery_mv);
  visit("MainVoltage", m.main_mv);
  visit("SwitchVoltage", m.switched_mv);
  visit("FocusMotorMoving", m.focus_motor_moving);
  visit("VoltageChanging", m.voltage_changing);
  visit("FocusMotorFaults", m.focus_faults);
  visit("FocusMotorStalled", m.focus_stalled, means::ping_status);
  visit("Faults", m.faults);
  visit("FocusCurrentPosition", m.focus_position);
  visit("RotatorTargets", m.rotator_targets);
  visit("RotatorErrors", m.rotator_errors);
  visit("ArmPositions", m.arm_positions);
  visit("RotatorAccelerations", m.rotator_accelerations);
  visit("AppliedSettings", m.applied_cookie);
  visit("ConstrainedSettings", m.constrained_cookie);
  visit("InvalidSettings", m.invalid_cookie);
  visit("EnableInterpacketDelay", m.interpacket_delay);
  visit("InterpacketDelayPeriod", m.interpacket_delay_us);
  visit("Uptime", m.uptime_s);
  visit("ArisAppVersionMajor", m.app_major);
  visit("ArisAppVersionMinor", m.app_minor);
  visit("GoTime", m.go_time_us);
  visit("RotatorVelocities", m.rotator_velocities);
  visit("GpsTimeAge", m.gps_age);
  visit("SystemVariant", m.system_variant);
  visit("CompassRevision", m.compass_revision);
  visit("Reserved", m.reserved);
}
inline constexpr std::size_t header_size = wire::wire_size<FrameHeader>();
static_assert(header_size == 744);

inline constexpr std::size_t longest_datagram = 1400;  // an older sample program has a buffer of that size

/// Converts from the picture, [samples][beams] with beam 0 farthest to starboard, to the order in which the device digitises:
/// [pings][samples][16 channels].
Bytes raw_from_picture(BytesView picture, std::size_t samples, int pings);
Bytes picture_from_raw(BytesView raw, std::size_t samples, int pings);

/// Makes the datagrams of a frame. The first has the header; all have samples. `longest`: largest size of a datagram in bytes, at
/// least 1400.
std::vector<Bytes> parts_of(std::int32_t frame_index, BytesView header, BytesView samples,
                            std::size_t longest = longest_datagram);
std::vector<Bytes> encode_frame(const Ping& ping, const protocol::DeviceState& device, const Settings& settings);

/// Finds a field in the first datagram of a frame.
std::optional<protocol::Field> locate(protocol::FieldName name, BytesView first_part);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView first_part);

Bytes make_beacon(const protocol::DeviceState& device);

/// Implements Vendor::change_integer() for a datagram of a frame, for two fields: ping_id (FrameIndex, which counts from 0) and
/// image_size (total_data_size).
bool change_part(protocol::FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& part);
/// Implements Vendor::change_integer() for a beacon, for these fields: device_id; connected_address (not 0: a controller is
/// connected); device_status (bits of an Oculus: 0x4000 too hot, 0x8000 stopped by heat).
bool change_beacon(protocol::FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& beacon);

/// A frame, assembled from all its parts.
struct DecodedFrame {
  std::int32_t index = 0;
  FrameHeader header;
  Bytes picture;  // [samples][beams], beam 0 farthest to starboard
  std::size_t samples = 0, beams = 0;
};
/// Collects the datagrams of a frame until it is complete. If the next frame begins before that, the incomplete frame is dropped
/// and counted.
class FrameAssembler {
 public:
  std::optional<DecodedFrame> add(BytesView datagram);
  std::uint64_t incomplete() const { return incomplete_; }

 private:
  std::optional<DecodedFrame> whole();
  std::int32_t index_ = 0;
  std::size_t total_ = 0, received_ = 0;
  bool done_ = true;
  Bytes header_, samples_;
  std::vector<bool> has_;  // for each byte of the samples: true if it has arrived
  std::uint64_t incomplete_ = 0;
};

}  // namespace sonar::aris
