#include "protocol/dvl/measure.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"

namespace sonar::dvl {
namespace {

constexpr double rssi_at_full_scale_dbm = 20;  // unknown: at 1 m; sand at 0.5 m then has -30 dBm, as in the example of DOC
constexpr double fom_without_velocity = 2.5;   // LOG: 2.4 to 2.7
constexpr auto longest_gap = std::chrono::seconds(3);  // over a longer gap between pings the velocity is unknown
constexpr double drift_mps = 0.1;                      // unknown: growth of the error of a position without a valid velocity

/// First number of the random streams of the beams. The streams of the pixels, in the same domain, have lower numbers.
constexpr std::uint32_t noise_stream = 1u << 16;

double standard_normal(const PingRequest& r, std::size_t beam) {
  const Random4 bits = philox(static_cast<std::uint32_t>(r.number), r.sonar_id, noise_stream + static_cast<std::uint32_t>(beam),
                              key_of(r.seed, Domain::range_noise));
  return std::sqrt(2.0) * static_cast<double>(complex_normal(bits.v[0], bits.v[1]).re);
}

/// Returns the standard deviation of a beam's velocity. unknown: the law. It was fitted to LOG, which has a fom of 0.2 mm/s at
/// rest and 1.3 mm/s at 0.5 m/s, 1.6 m above the ground.
double sigma_of(double along_mps, double speed_mps, double distance_m) {
  const double moving = std::hypot(0.003 * along_mps, 0.001 * speed_mps);
  return std::hypot(0.0001, moving) * (1 + distance_m / 25);
}

Beam beam_of(const Ping& ping, std::size_t index, Vec3d velocity_mps) {
  const RangePixel echo = pixel_of(index) * 4 + 4 <= ping.samples.size() ? range_pixel(ping, pixel_of(index)) : RangePixel{};
  const RangeImageSettings* const settings = range_image_of(ping.request);
  const double distance_m = settings != nullptr ? settings->range_unit_m * echo.range : 0;
  const PingSettings& s = ping.request.settings;
  Beam beam;
  beam.rssi_dbm = -150;
  if (echo.range == 0 || echo.strength == 0 || distance_m < s.range_start_m || distance_m > s.range_m) return beam;
  beam.is_valid = true;
  beam.distance_m = distance_m;
  // The receiver's gain grows by 40 dB per decade of distance (models.cpp). This gain is removed from the level.
  beam.rssi_dbm = rssi_at_full_scale_dbm + db_from_amplitude(echo.strength / static_cast<double>(RangePixel::most_strength)) -
                  40 * std::log10(distance_m);
  const double along_mps = dot(beam_direction(index), velocity_mps);
  beam.sigma_mps = sigma_of(along_mps, length(velocity_mps), distance_m);
  beam.velocity_mps = along_mps;
  if (ping.request.switches.noise) beam.velocity_mps += beam.sigma_mps * standard_normal(ping.request, index);
  return beam;
}

/// Returns the distance along the device's axis to the plane through the ends of the beams. A pair of opposite beams gives the
/// harmonic mean of their distances, times the cosine of the tilt. Returns the mean of valid pairs; -1 if there is none.
double altitude_of(const std::array<Beam, beam_count>& beams) {
  double sum = 0;
  int pairs = 0;
  for (std::size_t i = 0; i < beam_count / 2; ++i) {
    const Beam &one = beams[i], &other = beams[i + beam_count / 2];
    if (!one.is_valid || !other.is_valid) continue;
    sum += 2 * one.distance_m * other.distance_m / (one.distance_m + other.distance_m);
    ++pairs;
  }
  return pairs > 0 ? altitude_per_distance * sum / pairs : -1;
}

/// Returns the inverse of a symmetric matrix, computed from its minors. It exists for three valid beams, because their directions
/// are linearly independent.
Covariance inverse(const Covariance& m) {
  Covariance inverse{};
  const auto minor = [&](std::size_t i, std::size_t j) {
    const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[a][c] * m[b][d] - m[a][d] * m[b][c];
  };
  const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) inverse[j][i] = minor(i, j) / determinant;
  return inverse;
}

Vec3d turned(Vec3d v, double rad) {
  const double c = std::cos(rad), s = std::sin(rad);
  return {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
}
Covariance turned(const Covariance& m, double rad) {
  const Rotation r = rotation_from(turned_by(Vec3d{0, 0, rad}));
  Covariance out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t l = 0; l < 3; ++l) out[i][j] += r.m[i][k] * m[k][l] * r.m[j][l];
  return out;
}

/// Returns the orientation in the world of the vehicle's axes, which differ from those of the device by the mounting rotation.
Quatd vehicle_in_world(const PingRequest& request, const Settings& settings) {
  const double h = std::sqrt(0.5);
  const Quatd device_in_sonar{0, h, 0, h};  // the same rotation as device_from_sonar()
  return request.sonar_in_world.orientation * device_in_sonar *
         turned_by(Vec3d{0, 0, -rad_from_deg(settings.mounting_rotation_deg)});
}

}  // namespace

// Weights are the inverse variances of the beams. The covariance of the result is then the inverse of the information matrix.
Estimate estimate(const std::array<Beam, beam_count>& beams) {
  Covariance information{};
  std::array<double, 3> sums{};
  for (std::size_t i = 0; i < beam_count; ++i) {
    if (!beams[i].is_valid) continue;
    const Vec3d d = beam_direction(i);
    const std::array<double, 3> direction{d.x, d.y, d.z};
    const double weight = 1 / (beams[i].sigma_mps * beams[i].sigma_mps);
    for (std::size_t row = 0; row < 3; ++row) {
      sums[row] += weight * direction[row] * beams[i].velocity_mps;
      for (std::size_t column = 0; column < 3; ++column) information[row][column] += weight * direction[row] * direction[column];
    }
  }
  Estimate found;
  found.covariance = inverse(information);
  const auto component = [&](std::size_t i) {
    const auto& row = found.covariance[i];
    return row[0] * sums[0] + row[1] * sums[1] + row[2] * sums[2];
  };
  found.velocity_mps = {component(0), component(1), component(2)};
  return found;
}

double largest_eigenvalue(const Covariance& m) {
  // Trigonometric solution of the characteristic polynomial of a symmetric 3 x 3 matrix, whose roots are all real.
  const double mean = (m[0][0] + m[1][1] + m[2][2]) / 3;
  const double off = m[0][1] * m[0][1] + m[0][2] * m[0][2] + m[1][2] * m[1][2];
  double spread = 2 * off;
  for (std::size_t i = 0; i < 3; ++i) spread += (m[i][i] - mean) * (m[i][i] - mean);
  const double p = std::sqrt(spread / 6);
  if (!(p > 0)) return mean;
  Covariance b = m;
  for (std::size_t i = 0; i < 3; ++i) b[i][i] -= mean;
  const double determinant = b[0][0] * (b[1][1] * b[2][2] - b[1][2] * b[2][1]) -
                             b[0][1] * (b[1][0] * b[2][2] - b[1][2] * b[2][0]) +
                             b[0][2] * (b[1][0] * b[2][1] - b[1][1] * b[2][0]);
  return mean + 2 * p * std::cos(std::acos(std::clamp(determinant / (2 * p * p * p), -1.0, 1.0)) / 3);
}

Measurement measure(const Ping& ping) {
  const PingRequest& r = ping.request;
  const Settings settings = settings_from(r.vendor_settings.get());
  const double speed_mps = static_cast<double>(r.settings.device_sound_speed_mps);
  const double true_mps = true_sound_speed_mps(r.water, depth_from_z(r.sonar_in_world.position_m.z));
  const Vec3d moves = device_from_sonar(rotate(conjugate(r.sonar_in_world.orientation), r.sonar_moves.velocity_mps));
  // The device computes the velocity from the Doppler shift with its own sound speed, so a wrong sound speed scales the velocity.
  const Vec3d seen = speed_mps / true_mps * moves;
  Measurement m;
  std::size_t valid = 0;
  double farthest_m = 0;
  for (std::size_t i = 0; i < beam_count; ++i) {
    m.beams[i] = beam_of(ping, i, seen);
    valid += m.beams[i].is_valid;
    farthest_m = std::max(farthest_m, m.beams[i].distance_m);
  }
  if (valid == 0) farthest_m = r.settings.range_m;  // without an echo the device listens to the end of the range
  m.reflected_at = r.fired_at + nanoseconds_from(farthest_m / speed_mps);
  m.heard_at = r.fired_at + nanoseconds_from(2 * farthest_m / speed_mps);
  m.fom = fom_without_velocity;
  if (valid < 3 || length(seen) > product_of(*r.model).fastest_mps) return m;
  const Estimate found = estimate(m.beams);
  const double turn_rad = rad_from_deg(settings.mounting_rotation_deg);
  m.is_valid = true;
  m.velocity_mps = turned(found.velocity_mps, turn_rad);
  m.covariance = turned(found.covariance, turn_rad);
  m.fom = std::sqrt(largest_eigenvalue(m.covariance));
  m.altitude_m = altitude_of(m.beams);
  return m;
}

std::shared_ptr<const PingFindings> HeldSettings::look_at(const Ping& ping) const { return protocol::found(measure(ping)); }

// unknown: how the device searches. Here a device without a velocity tries the next higher mode, and the lowest after the
// highest. A device with a velocity keeps its mode while the altitude is within the limits of the mode (docs/protocols/dvl.md,
// "Range modes").
int next_mode(const Measurement& measured, const Settings& settings, const Product& product) {
  if (!measured.is_valid) return settings.mode < settings.highest_mode ? settings.mode + 1 : settings.lowest_mode;
  const auto has = [&](int index) {
    const RangeMode mode = range_mode(index, product);
    return measured.altitude_m >= mode.lowest_m && measured.altitude_m <= mode.highest_m;
  };
  if (has(settings.mode)) return settings.mode;
  for (int i = settings.lowest_mode; i <= settings.highest_mode; ++i)
    if (has(i)) return i;
  return settings.mode;
}

Reckoning reckoned(const Reckoning& before, const Measurement& measured, const PingRequest& request, const Settings& settings) {
  Reckoning now = before;
  now.last = vehicle_in_world(request, settings);
  now.at = request.fired_at;
  if (!before.is_started) {
    now = {.is_started = true, .at = now.at, .first = now.last, .last = now.last, .position_m = {}, .velocity_mps = {}};
  } else if (request.fired_at > before.at && request.fired_at - before.at <= longest_gap) {
    const double passed_s = seconds(request.fired_at - before.at);
    const double fom = measured.is_valid ? measured.fom : drift_mps;
    if (measured.is_valid) now.velocity_mps = rotate(conjugate(now.first) * now.last, measured.velocity_mps);
    // Trapezoidal rule: the mean of both velocities over the time between the pings.
    now.position_m = before.position_m + passed_s / 2 * (before.velocity_mps + now.velocity_mps);
    now.std_m = before.std_m + fom * passed_s;
  } else {  // after a gap the position continues where the reports of the gap ended
    const Reckoning reported = extrapolated(before, request.fired_at);
    now.position_m = reported.position_m;
    now.std_m = reported.std_m;
  }
  if (measured.is_valid) now.velocity_mps = rotate(conjugate(now.first) * now.last, measured.velocity_mps);
  now.fom = measured.is_valid ? measured.fom : drift_mps;
  return now;
}

Reckoning extrapolated(const Reckoning& last, Time now) {
  Reckoning r = last;
  if (!r.is_started || now <= r.at) return r;
  const double passed_s = seconds(std::min<std::chrono::nanoseconds>(now - r.at, longest_gap));
  r.position_m = r.position_m + passed_s * r.velocity_mps;
  r.std_m += passed_s * r.fom;
  return r;
}

}  // namespace sonar::dvl
