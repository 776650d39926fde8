// Properties of the water: its sound speed and its absorption. The physics uses them, and so do emulated devices that compute
// their assumed sound speed. Comments name formulae and sources. Oracles 27 to 29 in tests/core/sonar test the formulae. The
// code is C++17 and uses only the standard library.
#pragma once

namespace sonar {

struct Water {
  double temperature_c = 12;
  double salinity_psu = 30;
  double ph = 8.0;
  double sound_speed_mps = 0;  // 0 = computed from the rest (see true_sound_speed_mps)
};
constexpr bool operator==(const Water& a, const Water& b) {
  return a.temperature_c == b.temperature_c && a.salinity_psu == b.salinity_psu && a.ph == b.ph &&
         a.sound_speed_mps == b.sound_speed_mps;
}

/// Francois & Garrison 1982. Frequency [Hz], depth [m]; one-way, dB/m.
double absorption_db_per_m(const Water& water, double depth_m, double frequency_hz);
/// Chen & Millero / UNESCO 1983. T 0..40 C, S 0..40, gauge pressure 0..1000 bar.
double sound_speed_unesco_mps(double temperature_c, double salinity_psu, double pressure_bar);
/// Density from temperature and salinity [kg/m^3] (UNESCO EOS-80 at the surface).
double density_kg_per_m3(double temperature_c, double salinity_psu);
/// Absolute pressure [bar] at a depth: 1.013 + 0.0981 depth rho / 1000; depth below 0 counts as 0.
double absolute_pressure_bar(const Water& water, double depth_m);
/// The true sound speed: Water::sound_speed_mps if it is not 0, else UNESCO at that depth.
double true_sound_speed_mps(const Water& water, double depth_m);
/// Depth [m] of a position in the world: -z, at least 0, because the surface is at z = 0.
inline double depth_from_z(double z_m) { return z_m < 0 ? -z_m : 0; }

}  // namespace sonar
