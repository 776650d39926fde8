// The ARIS products as SonarModel rows, one mode per ping mode, frequency and lens, and the limits of their settings. models.cpp
// explains the names of sources, such as SMP.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/sonar/sonar_model.hpp"
#include "protocol/aris/messages.hpp"

namespace sonar::aris {

/// The receiver integrates over a sample period, so a row is the mean power of samples that are at most 1 / 1.5 pulses apart.
/// Evidence in SMP: levels spread about their local mean like means of 1.7 independent values.
inline constexpr double samples_per_pulse = 1.5;
inline constexpr int most_samples_per_row = 8;  // 1 would be no integration

inline constexpr int channels = 16;  // beams that one ping of a frame forms
/// Gains of the channels from starboard [dB], from SMP: the level of each channel's beams in frames 1 to 3, relative to the
/// neighbouring beams. Frames 4 to 6 agree within 0.25 dB rms. unknown: the gains of other units; all emulated units have these.
inline constexpr std::array<float, channels> channel_gain_db{-1.13f, 1.39f, -0.99f, 0.55f, -0.07f, -0.12f, -0.18f, 0.72f,
                                                             -0.48f, 0.63f, -0.74f, 0.67f, 0.23f,  -0.56f, 0.53f,  -0.45f};

/// A ping mode: a frame consists of `pings` interleaved pings of 16 beams each.
struct PingMode {
  std::uint32_t number = 0;
  int pings = 0;
  int beams() const { return channels * pings; }
};

struct Product {
  std::string_view profile;
  SystemType system{};
  std::vector<PingMode> ping_modes;
  bool has_telephoto = false;
  std::array<double, 2> pulse_limit_us{};  // at the low and the high frequency
  double pulse_energy_us_hz = 0;           // longest pulse times frame rate
  double window_end_m = 0;
  double small_period_margin = 0, period_margin = 0;  // margins of a cycle: for sample periods up to 4 us, and for longer ones
  Acoustics initial;                                  // used until a controller sends settings; from the vendor's sample program
};

std::span<const std::shared_ptr<const SonarModel>> models();
const Product& product_of(const SonarModel& model);

/// Selects a mode of the model. mode_index() returns nullopt if the product has no such ping mode.
struct ModeChoice {
  std::uint32_t ping_mode = 0;
  Frequency frequency{};
  bool telephoto = false;
  bool operator==(const ModeChoice&) const = default;
};
std::optional<int> mode_index(const Product& product, const ModeChoice& choice);
ModeChoice choice_of(const Product& product, int mode_index);
const PingMode* find_ping_mode(const Product& product, std::uint32_t number);

/// Returns the azimuths of the beams' centres [rad], from port to starboard.
std::vector<double> beam_azimuths(const Product& product, int beams, bool telephoto);

}  // namespace sonar::aris
