// Computes the measurement that the device reports for a ping (four beams, velocity, altitude), and the dead reckoning from one
// ping to the next.
#pragma once

#include "protocol/dvl/settings.hpp"

namespace sonar::dvl {

inline constexpr double usual_nsd_dbm = -90;  // DOC: -88 to -97 in its example; unknown: assumed the same for all beams

struct Beam {
  bool is_valid = false;
  double velocity_mps = 0;  // the device's velocity along the beam, positive towards the ground
  double sigma_mps = 0;     // standard deviation of the velocity's noise
  double distance_m = -1;   // computed with the device's speed of sound; -1 = no echo
  double rssi_dbm = 0, nsd_dbm = usual_nsd_dbm;
};

using Covariance = std::array<std::array<double, 3>, 3>;

/// The report of the device for a ping. Vectors are in the vehicle's frame: the device's frame, rotated by the mounting angle.
struct Measurement {
  std::array<Beam, beam_count> beams;
  bool is_valid = false;
  Vec3d velocity_mps;
  Covariance covariance{};
  double fom = 0, altitude_m = -1;
  Time reflected_at{}, heard_at{};  // times at which the farthest beam is reflected, and at which its echo arrives
  int status = 0;                   // 1 if the device is too hot, which is not emulated
};

/// Computes the measurement. The velocities of the beams follow from PingRequest::sonar_moves, which World computes from the
/// poses of the vehicle, and from the velocity in the newest pose if there is one.
Measurement measure(const Ping& ping);
/// Returns the measurement among the findings of the ping; computes it if there is none.
inline Measurement measured_in(const Ping& ping) { return protocol::found_in(ping, measure); }

/// Returns the range mode of the next ping.
int next_mode(const Measurement& measured, const Settings& settings, const Product& product);

Reckoning reckoned(const Reckoning& before, const Measurement& measured, const PingRequest& request, const Settings& settings);
/// Returns the position at `now`, after the last ping, extrapolated with the last velocity.
Reckoning extrapolated(const Reckoning& last, Time now);

struct Estimate {
  Vec3d velocity_mps;
  Covariance covariance{};
};
/// Returns the velocity in the device's frame, with weighted least squares from the valid beams (at least three).
Estimate estimate(const std::array<Beam, beam_count>& beams);
double largest_eigenvalue(const Covariance& m);

}  // namespace sonar::dvl
