// One ping: all its inputs (PingRequest) and its result (Ping). The result is a pure function of the request and the scene.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "core/sonar/water.hpp"

namespace sonar {

// Labels of a ping: for each sample, the object whose echo it contains (docs/datasets.md). core/pipeline/labels.hpp computes
// them.

/// Arrays are [rows][beams], as Ping::samples. Instance i + 1 is Scene::objects[i]; the point targets follow them.
struct PingLabels {
  int rows = 0, beams = 0;
  std::vector<std::uint16_t> instance;  // instance with the most energy, if above the receiver's noise; 0 = none
  std::vector<std::uint8_t> share;      // share of that instance in the sample's energy, noise included; 255 = all
  /// For samples without an instance: the nearest object that blocks the line of sight over the whole -3 dB width of the beam;
  /// 0 = no shadow. Echoes through the side lobes of the beam are ignored.
  std::vector<std::uint16_t> caster;
  /// [instance - 1]: fraction of the instance's energy that arrives, 0 to 1 (1 = nothing hides it); -1 for an object without a
  /// label.
  std::vector<float> visible;

  static constexpr std::size_t most_instances = 65535;
};

/// Models that convert the scene to scatterers (docs/acoustics.md, section 8).
enum class Mode {
  canonical,  // surface cells: the model of docs/acoustics.md
  paper,      // Choi 2025 as printed: a fixed fan of rays, a frequency sum, its own beamforming
  raster,     // like paper, but with scatterers on a perspective pixel grid, like simulators that rasterise
};
inline constexpr std::array<std::string_view, 3> mode_names = {"canonical", "paper", "raster"};

inline constexpr std::string_view name_of(Mode mode) { return mode_names[static_cast<std::size_t>(mode)]; }

/// Parts of the model that can be switched on and off (docs/acoustics.md, section 8). The defaults are the canonical model.
struct Switches {
  Mode mode = Mode::canonical;
  bool expected_power = false;  // sum |a|^2 instead of |sum a|^2: the result has no randomness
  int fixed_fan = 0;            // n > 0: n uniform rays per column, one scatterer per ray, no cells
  bool keep_pressure = false;   // fill Ping::pressure_upa
  bool keep_beams = false;      // fill Ping::beam_signal_upa
  bool keep_truth = false;      // fill Ping::truth
  bool keep_labels = false;     // fill Ping::labels; only the CPU engine computes such pings

  // The switches below have names for users, see named_switches. A part (volume, interference, leak, ...) that is on still has
  // no effect if the scene or the model has no data for it.
  bool noise = true;
  bool specular = true;
  bool texture = true;
  bool volume = true;
  bool multipath = false;  // traces the scene once more for every mirror
  bool motion = true;
  bool doppler = true;
  bool conical = true;
  bool crosstalk = true;
  bool leak = true;
  bool side_lobes = false;  // costs up to 10 %
  bool interference = true;
  bool grain = true;
  bool bandwidth = true;
  bool uneven = true;
  bool defocus = true;
  bool shared_noise = true;
  bool truncation = true;
  bool interleave = false;  // computes each of the pings that form a picture

  bool operator==(const Switches&) const = default;
};

/// The names by which the command line and the configuration switch parts of the model on and off.
struct NamedSwitch {
  const char* name;
  bool Switches::*is_on;
  const char* meaning;
};
inline constexpr std::array<NamedSwitch, 19> named_switches{{
    {"noise", &Switches::noise, "receiver noise"},
    {"specular", &Switches::specular, "specular echoes of smooth surfaces"},
    {"texture", &Switches::texture, "patchiness of materials that have a texture"},
    {"volume", &Switches::volume, "reverberation of the water itself"},
    {"multipath", &Switches::multipath, "paths via flat mirrors: water surface, tank walls"},
    {"motion", &Switches::motion, "motion of the sonar during the ping"},
    {"doppler", &Switches::doppler, "range shift of a moving sonar's frequency-modulated pulse"},
    {"conical", &Switches::conical, "beams as cones about the array; off: flat beams of constant azimuth"},
    {"crosstalk", &Switches::crosstalk, "leakage between receive channels"},
    {"leak", &Switches::leak, "the transmission received directly, in the first rows"},
    {"side_lobes", &Switches::side_lobes, "echoes from the elevation pattern's side lobes, -20 to -45 dB"},
    {"interference", &Switches::interference, "pulses of other sonars nearby"},
    {"grain", &Switches::grain, "sparse strong scatterers of materials that have a grain"},
    {"bandwidth", &Switches::bandwidth, "noise with the receiver's own bandwidth; off: with the pulse's"},
    {"uneven", &Switches::uneven, "noise, width and gain that differ from beam to beam"},
    {"defocus", &Switches::defocus, "blur of near echoes off broadside"},
    {"shared_noise", &Switches::shared_noise, "noise and leak that receive channels share, near the sonar"},
    {"truncation", &Switches::truncation, "samples cut off to whole codes; off: rounded"},
    {"interleave", &Switches::interleave, "beams of one picture from successive pings, where the model has them; off: from one"},
}};

/// Motion of the sonar during a ping.
struct Twist {
  Vec3d velocity_mps;        // velocity of the sonar in world axes
  Vec3d angular_rate_radps;  // sonar axes
};

struct Ping;

/// Base class of a device's findings in a ping, such as the points of a bottom. core does not read the contents.
struct PingFindings {
  virtual ~PingFindings() = default;
};

/// Base class of settings that a vendor's protocol needs besides PingSettings, such as the client's request. The message of a
/// ping states the settings with which the ping was made. core reads only two derived types: RangeImageSettings
/// (core/sonar/range_image.hpp) makes the ping a range image, PhasedSettings keeps signals of beams.
struct VendorSettings {
  virtual ~VendorSettings() = default;
  /// True if clients see no difference between these settings and `other`, which must be of the same vendor.
  virtual bool equals(const VendorSettings& other) const = 0;
  /// The device's findings in a ping that was made with these settings; null if the device makes none.
  virtual std::shared_ptr<const PingFindings> look_at(const Ping&) const { return nullptr; }
};

/// Meaning of the reported angles if the sonar assumes a sound speed that is not that of the water (docs/acoustics.md, section
/// 6).
enum class Bearings {
  are_true,             // beams point where the sonar reports them
  follow_device_speed,  // the beamformer uses delays for the device's sound speed
};
inline constexpr std::array<std::string_view, 2> bearings_names = {"true", "device_sound_speed"};

struct PingRequest {
  std::shared_ptr<const SonarModel> model;
  PingNumber number{};
  Time fired_at{};
  Pose sonar_in_world;                // at the time of firing
  Twist sonar_moves;                  // from firing to the last echo
  Pose vehicle_in_world;              // for the attitude and heading in packets
  std::vector<Pose> bodies_in_world;  // moving bodies, in the scene's order; empty = poses of the scene file
  Water water;
  PingSettings settings;
  std::shared_ptr<const VendorSettings> vendor_settings;  // may be null
  std::uint32_t sonar_id = 0;                             // part of the key of the receiver noise
  Seed seed{};
  Bearings bearings = Bearings::are_true;
  bool blank = false;  // noise only: poses are stale (on_stale: blank), or the sonar is out of the water
  Switches switches;
};

/// First hit of a beam: the nearest hit of the rays in its column within the -3 dB elevation width.
struct BeamTruth {
  static constexpr std::uint32_t nothing = 0xFFFFFFFFu;
  float range_m = 0;               // true range, 0 = nothing
  std::uint32_t object = nothing;  // index into Scene::objects
};

/// The result of a ping, for all vendors.
/// Row 0 is the nearest. Beam 0 is the one farthest to port: azimuths fall from + to -.
/// An array is empty, or a pointer null, if the ping does not have the value.
struct Ping {
  PingRequest request;
  std::vector<float> beam_azimuth_rad;  // [beams], positive to port
  std::vector<std::byte> samples;       // [rows][beams], little-endian, format.bits / 8 bytes each
  std::vector<std::uint32_t> row_gain;  // [rows] when format.row_gains: power gain applied to the row, at least 1
  std::vector<float> pressure_upa;      // [rows][beams] before TVG, when switches.keep_pressure
  std::vector<std::complex<float>>
      beam_signal_upa;                           // [samples][beams] before TVG, when switches.keep_beams, not in expected power
  std::vector<BeamTruth> truth;                  // [beams], when switches.keep_truth
  std::shared_ptr<const PingLabels> labels;      // when switches.keep_labels
  std::shared_ptr<const PingFindings> findings;  // set by look_at()

  const FrequencyMode& mode() const { return request.model->modes[static_cast<std::size_t>(request.settings.mode)]; }
};

/// Sets the findings of a ping. Call it again after a change of its request or samples.
inline void look_at(Ping& ping) {
  ping.findings = ping.request.vendor_settings != nullptr ? ping.request.vendor_settings->look_at(ping) : nullptr;
}

// Pings whose messages contain complex samples.

/// A ping with vendor settings of this type keeps the signals of its beams (Ping::beam_signal_upa), because the vendor's
/// message contains their phases.
struct PhasedSettings : VendorSettings {};

inline bool has_phases(const PingRequest& request) {
  return dynamic_cast<const PhasedSettings*>(request.vendor_settings.get()) != nullptr;
}

// Reads samples of a ping as unsigned integers.

/// The code of the sample `index` in samples of `width` bytes each, 1 to 4, the least significant byte first.
inline std::uint32_t sample_code(std::span<const std::byte> samples, std::size_t index, std::size_t width) {
  std::uint32_t code = 0;
  for (std::size_t b = 0; b < width; ++b) code |= std::to_integer<std::uint32_t>(samples[index * width + b]) << (8 * b);
  return code;
}

}  // namespace sonar
