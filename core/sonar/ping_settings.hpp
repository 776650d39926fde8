// Settings that a client may change between two pings, independent of the vendor. protocol/<vendor>/ computes them from the
// vendor's settings.
#pragma once

#include <cstdint>

namespace sonar {

/// Conversion of the amplitude v to a code. v is (pressure x TVG x gain) / full scale, so the linear scale saturates at v = 1
/// (docs/acoustics.md, eq. 37, 40).
struct SampleFormat {
  enum class Scale {
    linear,       // round(max_code v^gamma); a receiver may truncate instead, see ReceiverModel
    logarithmic,  // round(max_code (L - floor_db) / (ceiling_db - floor_db)), L = 20 log10 v: 0 dB is the linear full scale
  };
  int bits = 8;                  // 8, 16 or 32
  std::uint32_t max_code = 254;  // saturation value
  float gamma = 1;               // linear only
  bool row_gains = false;        // a power gain per row, see Ping::row_gain; linear only
  Scale scale = Scale::linear;
  float floor_db = 0, ceiling_db = 80;  // logarithmic: levels of codes 0 and max_code [dB re full scale], -300 to 300

  bool operator==(const SampleFormat&) const = default;
};

/// Ranges use the sound speed that the device assumes. Row i covers range_start_m + [i, i + 1) range_bin_m. The picture ends at
/// range_start_m + range_bin_count * range_bin_m. This equals range_m, except for the vendor's rounding to whole rows.
struct PingSettings {
  int mode = 0;  // index into SonarModel::modes
  int beam_count = 512;
  int range_bin_count = 437;      // rows
  double range_m = 10;            // the far end of the picture, as the device rounds it
  double range_start_m = 0;       // the near edge of row 0, below range_m; nearer echoes show only the tails of their pulses
  double range_bin_m = 0.0229;    // row spacing; packets carry it exactly
  double row_centre = 0.5;        // position of the samples in a row, see range_of_row: 0 near edge, 1 far edge
  float pulse_width_m = 0.0206f;  // -3 dB width in range, one way (docs/acoustics.md, section 4)
  int samples_per_row = 1;        // 1: a row is one sample; n: a row is the mean power of n samples
  float rate_hz = 10;             // 0 = standby
  double ping_interval_s = 0;     // between the pings of a picture, see FrequencyMode::interleaved_pings
  float gain_db = 0;
  bool gain_assist = false;              // the device changes the gain itself, starting at gain_db (core/sonar/gain_assist.hpp)
  bool tvg = true;                       // false: no time-varied gain, only G0 (Oculus 32-bit "scientific" data)
  float device_sound_speed_mps = 1500;   // sound speed that the device assumes
  float device_absorption_db_per_m = 0;  // one way, as the device's TVG assumes
  bool triggered = false;                // one ping per request of the client
  bool transmit = true;                  // false: the sonar receives noise only
  SampleFormat format;

  /// Range of a row's samples as computed by the device [m]; `row` may lie between two rows.
  double range_of_row(double row) const { return range_start_m + (row + row_centre) * range_bin_m; }

  bool operator==(const PingSettings&) const = default;
};

}  // namespace sonar
