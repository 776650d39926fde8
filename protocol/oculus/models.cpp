#include "protocol/oculus/models.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::oculus {
namespace {

// Sources of the numbers below, facts only. VND: the vendor's own sample viewer as mirrored in public repositories. ENS:
// ENSTABretagneRobotics oculus_driver. APL: liboculus, include/liboculus/Constants.h and part number list. BLU: BluEye-Robotics
// oculus_driver. BAS: bastianschildknecht sonar_driver. TID: tidewise drivers-sonar_oculus_m750d. CAT: the payload catalogue of
// the open simulator OceanSim, which quotes the vendor's data sheet DA-148-P01443-10 (2026) for the M series and integrators'
// pages for the C550d; the data sheet itself was not read. CAP: the captured M1200d pings. unknown: no public source; the value
// is assumed, or fitted as described in the comment.

/// unknown: fitted. The pressure that reaches full scale at TVG 0 dB and gain 0 dB. With it, the demo scene at gain 50 and gamma
/// 127 has an 8-bit median of 30 to 60. The other products were fitted to the same brightness at half their range. The captured
/// M1200d pings were not used: at their gain of 50 % a scene like theirs is 47 dB too weak (docs/acoustics.md, section 9). The
/// values are tuned only here.
namespace fitted_full_scale_upa {
constexpr float m370s = 2.2e10f, c550d_low = 1.9e10f, c550d_high = 1.4e10f, m750d_low = 2e10f, m750d_high = 1.5e10f;
constexpr float m1200d_low = 1.5e10f, m1200d_high = 3.5e10f, m3000d_low = 1.4e10f, m3000d_high = 3.3e10f;
}  // namespace fitted_full_scale_upa

constexpr float source_level_db = 200;  // unknown: assumed; Choi et al. 2025 fitted 170 dB to an M1200d, with other gains
constexpr float tvg_ceiling_db = 80;    // unknown: assumed

// unknown: fitted to the captured M1200d ping (docs/acoustics.md, section 9), and used for all products, because they share their
// electronics, as far as is known. The law was found from the noise, the part of the picture that changes between pings. The
// noise increases by 35 dB from 0.1 to 1.9 m, but hardly below 0.25 m. The leak is in rows 0 to 6 and ends within the range of
// one pulse.
constexpr float tvg_slope_db = 35, tvg_minimum_range_m = 0.25f;
constexpr float leak_upa = 4.2e5f, leak_decay_db_per_m = 2000;
// unknown: fitted to the captured M1200d ping on the assumption that its bed is soft mud (-40 dB): the echo of the bed at 1
// m is 30 dB above the noise. Other modes: assumed.
constexpr float noise_figure_db = 10, m1200d_high_noise_figure_db = 14.6f;

/// unknown: fitted to the first two captured M1200d pings. Of several fits, the one that agrees best with all three pings was
/// kept (docs/acoustics.md, section 9). The values are used only for the mode of these pings.
void fit_to_recording(ReceiverModel& receiver) {
  // Small echoes within 0.5 m are 3 beams wide at half their amplitude ahead, 5 to 7 at 20 degrees.
  receiver.defocus = 0.4f;
  // The noise across the fan. `noise_db` is from rows 620 to 702, which have a stripe in the middle, `near_noise_db` from rows 20
  // to 150.
  receiver.profile.noise_db = {-5.6f, -6.2f, -3.9f, -2.3f, -1.7f, 0.3f,  -0.1f, 0.7f, 2.6f,
                               0.7f,  0.1f,  -0.1f, -1.0f, -2.7f, -3.2f, -5,    -5.3f};
  receiver.profile.near_noise_db = {-9.9f, -9.9f, -9.9f, -8.7f, -8.7f, -8.7f, -8.7f, -6.4f, -4.1f,
                                    -6.4f, -8.7f, -8.7f, -8.7f, -8.7f, -9.9f, -9.9f, -9.9f};
  receiver.profile.near_m = 0.4f;
  // The noise that the channels share has three traces. In rows 0 and 1 the leak is a comb across the fan. In rows 8 to 20 the
  // noise has steady fringes. In rows 10 to 180 it lies beside a dome, in grains that are wider at shorter ranges. The traces fit
  // 128 channels whose neighbours have opposite signs, and a direction with a sine of 0.56 (half a wavelength of the low mode
  // would give 0.57).
  receiver.shared_noise = {.level_db = 3.4f, .full_m = 0.2f, .steady = 0.6f, .focus_rows = 0.5f, .nearest_focus_m = 0.0085f};
  receiver.leak_is_shared = true;
  // 255 never occurs. Codes 0 to 5 of the noise are as frequent as those of floor(255 v^gamma), with v below 1.
  receiver.truncates = true;
  receiver.profile.blend = {-0.1f, 0.07f, 0.1f, 0.13f, 0.13f, 0.13f, 0.13f, 0.06f, -0.1f};
  // The leak rings, with a null in row 2. Its level is the median of rows 0 to 8, in steps of half a row.
  receiver.leak_ring_db = {-5.4f, -5.4f,  -5.2f, -5.1f,  -16, -28,    -24.5f, -22.7f, -21, -19.4f,
                           -21,   -22.6f, -25,   -28.2f, -31, -33.5f, -38,    -45,    -60};
  receiver.leak_ring_step_m = 0.001421f;
}

constexpr double usual_pulse_rows = 0.9;  // chosen so that a point between two rows is visible
// unknown: in the captured M1200d ping the echoes fit 0.66 rows, and the noise fits 0.71 (it is uncorrelated in neighbouring
// rows). Echoes and noise pass the same filter, so one width is used. At 0.66 the surface cells, whose width is a power of two,
// would be half as wide, and a ping at 2 m would take twice as long.
constexpr double recorded_pulse_rows = 0.71;

struct ModeRow {
  double centre_hz = 0, aperture_deg = 0, azimuth_width_deg = 0, elevation_width_deg = 0, max_range_m = 0;
  float full_scale_upa = 0;
  float noise_db = noise_figure_db;
  bool recorded = false;
};
struct FamilyRow {
  double min_range_m = 0.1;  // BAS
  ModeRow low, high;         // high.centre_hz 0: one mode only
};
/// A product. Products with the same electronics share a family.
struct ProfileRow {
  std::string_view profile, name;
  std::uint16_t part_number = 0;
  const FamilyRow* family = nullptr;
};

// 370 kHz and 200 m: VND, ENS; aperture and minimum range: BAS; elevation 20: VND; azimuth width 2.0: CAT; an array as long as
// the M750d's (1.0 at 750 kHz) has the same width.
constexpr FamilyRow m370s{0.2, {370e3, 130, 2.0, 20, 200, fitted_full_scale_upa::m370s}, {}};
// Frequencies and ranges: VND; apertures, elevation, minimum range: CAT; unknown: azimuth widths 1.0 and 0.7.
constexpr FamilyRow c550d{0.2,
                          {550e3, 120, 1.0, 20, 100, fitted_full_scale_upa::c550d_low},
                          {820e3, 90, 0.7, 20, 30, fitted_full_scale_upa::c550d_high}};
// Frequencies, ranges, azimuth widths: APL, VND; aperture 130 in both modes: BAS, TID, CAT; elevation 20 in both: CAT.
constexpr ModeRow m750d_low{750e3, 130, 1.0, 20, 120, fitted_full_scale_upa::m750d_low};
constexpr FamilyRow m750d{0.1, m750d_low, {1.2e6, 130, 0.6, 20, 40, fitted_full_scale_upa::m750d_high}};
// Older hardware: 12 deg elevation in the high mode (APL); unknown: aperture 70, which no source states for this hardware.
constexpr FamilyRow m750d_old{0.1, m750d_low, {1.2e6, 70, 0.6, 12, 40, fitted_full_scale_upa::m750d_high}};
// Low: BAS, APL, VND. High: frequency 140.625 MHz / 67 and aperture 60 from CAP, widths and range APL.
constexpr ModeRow m1200d_low{1.2e6, 130, 0.6, 20, 40, fitted_full_scale_upa::m1200d_low};
constexpr FamilyRow m1200d{
    0.1, m1200d_low, {140.625e6 / 67, 60, 0.4, 12, 10, fitted_full_scale_upa::m1200d_high, m1200d_high_noise_figure_db, true}};
// unknown: a single-frequency product by its name; the low mode of the M1200d is assumed.
constexpr FamilyRow n1200s{0.1, m1200d_low, {}};
// Frequencies, ranges, widths low: APL, VND; apertures: CAT. Azimuth width high: CAT has 0.25, which an array with 0.6 at 1.2 MHz
// has at 3.0 MHz; APL's 0.4 is the figure of the M1200d's high mode.
constexpr FamilyRow m3000d{0.1,
                           {1.2e6, 130, 0.6, 20, 30, fitted_full_scale_upa::m3000d_low},
                           {3.0e6, 40, 0.25, 20, 5, fitted_full_scale_upa::m3000d_high}};

// Part numbers: older list ENS, BAS; newer list APL, VND, BLU. All clients accept 1032, 1041 and 1042.
constexpr ProfileRow profiles[] = {
    {"oculus-m370s", "Oculus M370s", 1041, &m370s},
    {"oculus-m750d", "Oculus M750d", 1032, &m750d},
    {"oculus-m1200d", "Oculus M1200d", 1042, &m1200d},
    {"oculus-m3000d", "Oculus M3000d", 2203, &m3000d},
    {"oculus-c550d", "Oculus C550d", 4713, &c550d},
    {"oculus-m750d-hf130", "Oculus M750d, 130 deg in mode 2", 1032, &m750d},  // an earlier name, which configurations may have
    {"oculus-m750d-hf12", "Oculus M750d, older hardware", 1032, &m750d_old},
    {"oculus-m373s", "Oculus M373s", 1209, &m370s},
    {"oculus-m373s-deep", "Oculus M373s deep", 1218, &m370s},
    {"oculus-m370s-deep", "Oculus M370s deep", 1217, &m370s},
    {"oculus-m370s-artemis", "Oculus MA370s", 1229, &m370s},
    {"oculus-md370s", "Oculus MD370s", 1433, &m370s},
    {"oculus-mf370s", "Oculus MF370s", 1436, &m370s},
    {"oculus-md370s-burton", "Oculus MD370s Burton", 2294, &m370s},
    {"oculus-mt370s", "Oculus MT370s", 2418, &m370s},
    {"oculus-m750d-fusion", "Oculus MF750d", 1134, &m750d},
    {"oculus-m750d-artemis", "Oculus MA750d", 1135, &m750d},
    {"oculus-md750d-impulse", "Oculus MD750d Impulse", 1244, &m750d},
    {"oculus-md750d", "Oculus MD750d", 1434, &m750d},
    {"oculus-md750d-burton", "Oculus MD750d Burton", 1921, &m750d},
    {"oculus-mt750d", "Oculus MT750d", 2419, &m750d},
    {"oculus-m1200d-deep", "Oculus M1200d deep", 1219, &m1200d},
    {"oculus-m1200d-artemis", "Oculus MA1200d", 1228, &m1200d},
    {"oculus-md1200d", "Oculus MD1200d", 1435, &m1200d},
    {"oculus-mf1200d", "Oculus MF1200d", 1437, &m1200d},
    {"oculus-md1200d-burton", "Oculus MD1200d Burton", 2086, &m1200d},
    {"oculus-mt1200d", "Oculus MT1200d", 2420, &m1200d},
    {"oculus-n1200s", "Oculus N1200s", 1220, &n1200s},
    {"oculus-n1200s-deep", "Oculus N1200s deep", 1221, &n1200s},
    {"oculus-mf3000d", "Oculus MF3000d", 2466, &m3000d},
    {"oculus-mt3000d", "Oculus MT3000d", 2599, &m3000d},
    {"oculus-md3000d-impulse", "Oculus MD3000d Impulse", 2658, &m3000d},
    {"oculus-md3000d-burton", "Oculus MD3000d Burton", 2659, &m3000d},
    {"oculus-ma3000d", "Oculus MA3000d", 2924, &m3000d},
};

float radians(double deg) { return static_cast<float>(rad_from_deg(deg)); }

FrequencyMode mode_from(const ModeRow& row, double min_range_m, const char* name) {
  FrequencyMode mode;
  mode.name = name;
  mode.centre_hz = static_cast<float>(row.centre_hz);
  mode.horizontal_aperture_rad = radians(row.aperture_deg);
  mode.min_range_m = static_cast<float>(min_range_m);
  mode.max_range_m = static_cast<float>(row.max_range_m);
  mode.source_level_db = source_level_db;
  mode.beam_spacing = BeamSpacing::uniform_in_sine;  // CAP; assumed for other apertures too
  mode.pattern.azimuth_width_rad = radians(row.azimuth_width_deg);
  mode.pattern.elevation_width_rad = radians(row.elevation_width_deg);
  mode.receiver.tvg_slope_db = tvg_slope_db;
  mode.receiver.tvg_minimum_range_m = tvg_minimum_range_m;
  mode.receiver.tvg_ceiling_db = tvg_ceiling_db;
  mode.receiver.noise_figure_db = row.noise_db;
  mode.receiver.leak_upa = leak_upa;
  mode.receiver.leak_decay_db_per_m = leak_decay_db_per_m;
  mode.receiver.full_scale_upa = row.full_scale_upa;
  if (row.recorded) fit_to_recording(mode.receiver);
  return mode;
}

std::shared_ptr<const SonarModel> model_from(const ProfileRow& row) {
  SonarModel model;
  model.profile = row.profile;
  model.name = row.name;
  model.part_number = row.part_number;
  model.max_rate_hz = 40;  // highest rate code of the fire message
  const FamilyRow& family = *row.family;
  model.modes.push_back(mode_from(family.low, family.min_range_m, "LF"));
  if (family.high.centre_hz > 0) model.modes.push_back(mode_from(family.high, family.min_range_m, "HF"));
  return std::make_shared<const SonarModel>(std::move(model));
}

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() {
  static const std::vector<std::shared_ptr<const SonarModel>> built = [] {
    std::vector<std::shared_ptr<const SonarModel>> all;
    for (const ProfileRow& row : profiles) all.push_back(model_from(row));
    return all;
  }();
  return built;
}

double pulse_rows(const SonarModel& model, int mode) {
  const auto* const row =
      std::find_if(std::begin(profiles), std::end(profiles), [&](const ProfileRow& of) { return of.profile == model.profile; });
  if (row == std::end(profiles)) return usual_pulse_rows;
  return (mode == 0 ? row->family->low : row->family->high).recorded ? recorded_pulse_rows : usual_pulse_rows;
}

}  // namespace sonar::oculus
