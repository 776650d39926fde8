// The constants of a product, for each of its frequency modes. The folder of the product's make contains the values.
#pragma once

#include <complex>
#include <cstdint>
#include <string>
#include <vector>

namespace sonar {

// The pulse p(t), p(0) = 1: the output of the matched filter for one point echo. The shape is a constant of the product; the
// width is PingSettings::pulse_width_m unless the pulse was measured (docs/acoustics.md, section 4).

struct Waveform {
  enum class Shape {
    gaussian,  // exp(-b^2 t^2), Choi 2025 eq. 3; the default
    cw,        // a rectangular tone of length T after its matched filter: a triangle, -3 dB width 0.293 c T
    lfm,       // a linear sweep after compression with a Hamming window: side lobes at -42 dB, -3 dB width 1.30 / sweep
    measured,  // the shape of `samples`
  };
  Shape shape = Shape::gaussian;
  /// For lfm: duration and direction of the sweep. Falling sweeps shift ranges in the opposite direction. Only the Doppler
  /// range shift uses these values.
  float sweep_s = 1e-3f;
  bool falling = false;
  /// For `measured`: complex envelope after the matched filter at sample_rate_hz, with the peak in the middle, at most 65536
  /// samples.
  std::vector<std::complex<float>> samples;
  double sample_rate_hz = 0;
  /// True: pulses are summed in the frequency domain (exact up to the band limit) instead of with a table of the pulse.
  /// `measured` pulses are always summed in this way.
  bool exact = false;
#if __cplusplus >= 202002L  // device code is C++17 and needs no comparison
  bool operator==(const Waveform&) const = default;
#endif
};

/// Aperture shading of the receive array; it determines the side lobes. `unit` switches the pattern off (1 everywhere).
enum class Taper { uniform, taylor30, hamming, hann, unit };
/// Meaning of the data sheet's vertical width: the width of one pattern, or of the product of transmit and receive patterns
/// (docs/acoustics.md, section 6).
enum class ElevationWidthIs { one_way, two_way };
enum class BeamSpacing {
  uniform_in_sine,   // beam azimuths asin(s), s linear over +-sin(half aperture): Oculus
  uniform_in_angle,  // beams in the middles of equal parts of the aperture: BlueView
  listed,            // FrequencyMode::beam_azimuths_rad
};

struct BeamPattern {
  float azimuth_width_rad = 0;    // -3 dB width of one receive beam at broadside
  float elevation_width_rad = 0;  // -3 dB width, see elevation_width_is
  Taper azimuth_taper = Taper::taylor30;
  Taper elevation_taper = Taper::uniform;  // uniform (product of two equal sincs) or unit
  ElevationWidthIs elevation_width_is = ElevationWidthIs::two_way;
};

/// Measured differences between beams (docs/acoustics.md, sections 5 and 6). Each table has values at uniform steps of the
/// sine, from the port edge of the sector to its starboard edge; empty = no difference.
struct BeamProfile {
  std::vector<float> noise_db;       // receiver noise re eq. 30, far from the sonar
  std::vector<float> near_noise_db;  // the same at range 0; same length as noise_db
  float near_m = 0.2f;               // weight of noise_db at range r: 1 - e^{-r / near_m}
  std::vector<float> blend;          // amplitude, re the beam's own, of the added neighbours half a beam width away
};

/// Noise that receive channels share, with opposite signs in neighbours (docs/acoustics.md, section 5).
struct SharedNoise {
  float level_db = -200;  // level of a channel, re the channel's own noise; below -150 = none
  int channels = 128;     // even
  // Number of neighbouring channels that share a signal; even; half of it divides `channels`. Their weights decrease to both
  // ends.
  int group = 32;
  float sine = 0.56f;    // sine of the apparent direction at long range: half a wavelength / channel spacing
  float full_m = 0.25f;  // at shorter ranges the power is proportional to the range
  float steady = 0;      // fraction of the power that is the same in every ping and in phase in all channels
  float focus_rows = 0;  // number of rows from the centre of a row to the array's focus, which is farther
  float nearest_focus_m = 0;
};

/// Conversion of pressure to samples in the receiver (docs/acoustics.md, section 7). The values are constants of the product.
struct ReceiverModel {
  float tvg_slope_db = 30;  // X in X log10 r
  float tvg_minimum_range_m = 0.5f;
  float tvg_ceiling_db = 80;  // upper limit of the TVG; infinity: no limit
  float full_scale_upa = 1;   // pressure amplitude that reaches full scale at TVG 0 dB and gain 0 dB
  float noise_figure_db = 10;
  // -3 dB width of the noise filter divided by the width of the pulse's filter. It is unused for a measured pulse, because the
  // pulse is then the filter.
  float noise_width = 1;
  float crosstalk_db = -200;  // amplitude, re the channel, of every channel in every beam; below -150 = none
  float leak_upa = 0;         // rms pressure of the transmitter's direct leakage, at range 0; 0 = none
  float leak_decay_db_per_m = 30;
  std::vector<float>
      leak_ring_db;  // level re leak_upa at multiples of leak_ring_step_m, none after the last; replaces leak_decay_db_per_m
  float leak_ring_step_m = 0.003f;
  bool leak_is_shared = false;  // true: the channels share it, like shared_noise; false: each column has a random phase
  BeamProfile profile;
  /// Gains of the receive channels, beginning at port. Each channel serves the same number of neighbouring beams. Empty = no
  /// difference.
  std::vector<float> channel_gain_db;
  SharedNoise shared_noise;
  /// 0: receive beams are focused at every range and bearing. 1: all beams use the delays of broadside. Beams off broadside are
  /// then blurred at short range (docs/acoustics.md, section 6).
  float defocus = 0;
  /// True: codes of a linear scale are floor((max_code + 1) v^gamma), not rounded (docs/acoustics.md, section 7).
  bool truncates = false;
};

struct FrequencyMode {
  std::string name;  // "HF", "LF"
  float centre_hz = 0;
  float horizontal_aperture_rad = 0;
  float min_range_m = 0.1f;
  float max_range_m = 0;
  float source_level_db = 0;  // dB re 1 uPa rms at 1 m
  BeamSpacing beam_spacing = BeamSpacing::uniform_in_sine;
  /// For `listed`: direction of each beam, positive to port and strictly falling, within +- horizontal_aperture_rad / 2 (the
  /// sector that the transmitter covers). PingSettings::beam_count is their number.
  std::vector<double> beam_azimuths_rad;
  /// For `listed`: -3 dB width of each beam in azimuth, in its own direction. If empty, the width is pattern.azimuth_width_rad
  /// at broadside for all beams and widens as 1 / cos(azimuth). The noise level is that of a beam of the pattern's width.
  std::vector<float> beam_widths_rad;
  /// Number of successive pings that are combined to a picture. Neighbouring beams come from successive pings, the last beam
  /// from the first ping (docs/acoustics.md, section 6).
  int interleaved_pings = 1;
  BeamPattern pattern;
  Waveform waveform;
  ReceiverModel receiver;

  bool has_own_widths() const { return beam_spacing == BeamSpacing::listed && !beam_widths_rad.empty(); }
};

struct SonarModel {
  std::string profile;  // the name in a configuration: "oculus-m1200d"
  std::string name;     // the name for users: "Oculus M1200d"
  std::uint16_t part_number = 0;
  std::vector<FrequencyMode> modes;
  float max_rate_hz = 40;
};

}  // namespace sonar
