// The settings that commands change, and the resulting grids of samples.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "core/sonar/sonar_model.hpp"
#include "protocol/held_settings.hpp"
#include "protocol/vendor.hpp"

namespace sonar::norbit {

// The products. Sources: protocol/norbit/README.md.

inline constexpr int bottom_beams = 256;                          // beams of bathymetry
inline constexpr double swath_deg = 140, beam_width_deg = 0.9;    // DFD; from memory
inline constexpr double sample_hz = 78125;                        // DFD
inline constexpr double farthest_m = 600, fastest_hz = 60;        // DFD
inline constexpr double shortest_m = 1;                           // shortest length of the range; our choice
inline constexpr double frequency_khz = 400, bandwidth_khz = 80;  // DFD
inline constexpr int amplitude = 15, pulse_us = 500;              // DFD

/// Returns two products: one points down, the other ahead.
std::span<const std::shared_ptr<const SonarModel>> models();
/// Returns the mode, which depends on the mounting of the sonar: 0 = forward, 1 = bathymetry.
int mode_of(const SonarModel& model);

inline constexpr double most_gain_db = 40;          // DFD
inline constexpr double gain_slope_db_per_m = 0.5;  // per metre of two-way range; DFD 2D

/// Format of the samples from which both packets are made. The samples include gain_db.
inline constexpr SampleFormat sample_format{
    .bits = 16, .max_code = 65535, .scale = SampleFormat::Scale::logarithmic, .floor_db = -120, .ceiling_db = 40};

struct Settings {
  int power = 0;                    // 0 = off, 1 = pings
  double start_m = 0, stop_m = 10;  // our choice; stop_m in DFD: 50, or the product's value
  double rate_hz = -1;              // -1 = the highest rate that the range permits
  double gain_db = 20;
  int samples = 256, beams = 128;  // size of the water column; the number of samples is approximate
  double sound_mps = -1;           // -1 = the measured sound speed
  bool operator==(const Settings&) const = default;
};
/// Finds the bottom and the pixels of the water column (packet.cpp).
std::shared_ptr<const PingFindings> findings_of(const Settings& settings, const Ping& ping);
using HeldSettings = protocol::Held<Settings>;
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the reason why a sonar cannot have these settings; empty if it can.
std::string complaint(const Settings& settings);

/// The grids of samples and rows. Samples are counted from the transmission, at sample_hz. Rows of the ping are `step` samples
/// apart; rows of the water column are `thin` rows of the ping apart.
struct Grid {
  int first = 0, step = 1, rows = 0;  // first: a multiple of step * thin
  int thin = 1;
  double sample_m = 0;  // difference in range of successive samples
  int column_rows() const { return (rows + thin - 1) / thin; }
};
Grid grid_of(const Settings& settings, double sound_mps);
double sound_mps(const Settings& settings, const protocol::DeviceState& device);

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);
inline double gain_percent(const Settings& settings) { return 100 * settings.gain_db / most_gain_db; }

}  // namespace sonar::norbit
