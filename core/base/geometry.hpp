// Vectors, quaternions and poses, as plain structs for all modules. World axes are ENU (x east, y north, z up); axes of bodies
// and sonars are FLU (x ahead, y to port, z up). Quaternions follow Hamilton's convention; the orientation of a pose a_in_b
// rotates vectors of a into b. nvcc compiles this file too, so it uses only C++17.
#pragma once

#include <cmath>

#include "core/base/host_device.hpp"

namespace sonar {

struct Vec3 {  // directions, and positions near an origin, such as the vertices of a mesh [m]
  float x = 0, y = 0, z = 0;
};
struct Vec3d {  // positions in the world [m], velocities, directions
  double x = 0, y = 0, z = 0;
};
struct Quatd {
  double w = 1, x = 0, y = 0, z = 0;
};
/// Pose of a, expressed in b: named `a_in_b`.
struct Pose {
  Vec3d position_m;
  Quatd orientation;
};
/// A rotation as a row-major matrix, for code that rotates many vectors by one quaternion.
struct Rotation {
  double m[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
};
/// Intrinsic Z-Y-X angles: yaw about z first, then pitch about the new y, then roll about the new x.
struct RollPitchYaw {
  double roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
};

inline constexpr double pi = 3.14159265358979323846;
SONAR_HD constexpr double rad_from_deg(double deg) { return deg * (pi / 180.0); }
SONAR_HD constexpr double deg_from_rad(double rad) { return rad * (180.0 / pi); }

// The comparisons are written by hand, because C++17 has no defaulted ones.
SONAR_HD constexpr bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
SONAR_HD constexpr bool operator==(Vec3d a, Vec3d b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
SONAR_HD constexpr bool operator==(Quatd a, Quatd b) { return a.w == b.w && a.x == b.x && a.y == b.y && a.z == b.z; }
SONAR_HD constexpr bool operator==(const Pose& a, const Pose& b) {
  return a.position_m == b.position_m && a.orientation == b.orientation;
}

SONAR_HD constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
SONAR_HD constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
SONAR_HD constexpr Vec3 operator*(float s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
SONAR_HD constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SONAR_HD constexpr Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
SONAR_HD inline float length(Vec3 a) { return std::sqrt(dot(a, a)); }

SONAR_HD constexpr Vec3d operator+(Vec3d a, Vec3d b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
SONAR_HD constexpr Vec3d operator-(Vec3d a, Vec3d b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
SONAR_HD constexpr Vec3d operator*(double s, Vec3d a) { return {s * a.x, s * a.y, s * a.z}; }
SONAR_HD constexpr double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SONAR_HD constexpr Vec3d cross(Vec3d a, Vec3d b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
SONAR_HD inline double length(Vec3d a) { return std::sqrt(dot(a, a)); }
/// Returns a vector of length 1. The zero vector stays zero.
SONAR_HD inline Vec3d unit_vector(Vec3d a) {
  const double l = length(a);
  return l > 0 ? (1 / l) * a : a;
}

SONAR_HD constexpr Vec3d to_double(Vec3 a) { return {a.x, a.y, a.z}; }
SONAR_HD constexpr Vec3 to_float(Vec3d a) { return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)}; }

SONAR_HD constexpr Quatd operator*(Quatd a, Quatd b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
SONAR_HD constexpr Quatd conjugate(Quatd q) { return {q.w, -q.x, -q.y, -q.z}; }
SONAR_HD constexpr double norm_squared(Quatd q) { return q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z; }
/// Returns q with length 1. q must not be zero: callers check values from outside first.
SONAR_HD inline Quatd normalized(Quatd q) {
  const double s = 1.0 / std::sqrt(norm_squared(q));
  return {q.w * s, q.x * s, q.y * s, q.z * s};
}
SONAR_HD constexpr Vec3d rotate(Quatd q, Vec3d v) {
  const Vec3d u{q.x, q.y, q.z};
  const Vec3d t = 2.0 * cross(u, v);
  return v + q.w * t + cross(u, t);
}

/// a_in_c = compose(b_in_c, a_in_b)
SONAR_HD constexpr Pose compose(const Pose& b_in_c, const Pose& a_in_b) {
  return {b_in_c.position_m + rotate(b_in_c.orientation, a_in_b.position_m), b_in_c.orientation * a_in_b.orientation};
}
/// b_in_a = inverse(a_in_b)
SONAR_HD constexpr Pose inverse(const Pose& a_in_b) {
  const Quatd q = conjugate(a_in_b.orientation);
  return {rotate(q, Vec3d{-a_in_b.position_m.x, -a_in_b.position_m.y, -a_in_b.position_m.z}), q};
}
/// Returns the point `p_in_a` expressed in b.
SONAR_HD constexpr Vec3d transform(const Pose& a_in_b, Vec3d p_in_a) {
  return a_in_b.position_m + rotate(a_in_b.orientation, p_in_a);
}

SONAR_HD inline Rotation rotation_from(Quatd q) {
  Rotation r;
  const Vec3d ex = rotate(q, Vec3d{1, 0, 0}), ey = rotate(q, Vec3d{0, 1, 0}), ez = rotate(q, Vec3d{0, 0, 1});
  r.m[0][0] = ex.x, r.m[0][1] = ey.x, r.m[0][2] = ez.x;
  r.m[1][0] = ex.y, r.m[1][1] = ey.y, r.m[1][2] = ez.y;
  r.m[2][0] = ex.z, r.m[2][1] = ey.z, r.m[2][2] = ez.z;
  return r;
}

SONAR_HD constexpr Vec3d operator*(const Rotation& r, Vec3d v) {
  return {r.m[0][0] * v.x + r.m[0][1] * v.y + r.m[0][2] * v.z, r.m[1][0] * v.x + r.m[1][1] * v.y + r.m[1][2] * v.z,
          r.m[2][0] * v.x + r.m[2][1] * v.y + r.m[2][2] * v.z};
}
SONAR_HD constexpr Rotation operator*(const Rotation& a, const Rotation& b) {
  Rotation c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
  return c;
}
SONAR_HD constexpr Rotation transposed(const Rotation& r) {
  Rotation t;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) t.m[i][j] = r.m[j][i];
  return t;
}

/// Returns the rotation about the vector through an angle equal to the vector's length [rad].
SONAR_HD inline Quatd turned_by(Vec3d rotation_rad) {
  const double angle = length(rotation_rad);
  const double part = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
  return {std::cos(angle / 2), part * rotation_rad.x, part * rotation_rad.y, part * rotation_rad.z};
}
SONAR_HD inline Quatd quat_from_rpy(const RollPitchYaw& a) {
  const double cr = std::cos(a.roll_rad / 2), sr = std::sin(a.roll_rad / 2);
  const double cp = std::cos(a.pitch_rad / 2), sp = std::sin(a.pitch_rad / 2);
  const double cy = std::cos(a.yaw_rad / 2), sy = std::sin(a.yaw_rad / 2);
  return {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy};
}
SONAR_HD inline RollPitchYaw rpy_from_quat(Quatd q) {
  const double s = 2 * (q.w * q.y - q.z * q.x);
  const double clamped = s > 1 ? 1 : (s < -1 ? -1 : s);
  return {std::atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x * q.x + q.y * q.y)), std::asin(clamped),
          std::atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))};
}

/// Converts North-East-Down to East-North-Up, and back.
SONAR_HD constexpr Vec3d enu_from_ned(Vec3d ned) { return {ned.y, ned.x, -ned.z}; }
/// Converts Forward-Right-Down to Forward-Left-Up, and back.
SONAR_HD constexpr Vec3d flu_from_frd(Vec3d frd) { return {frd.x, -frd.y, -frd.z}; }
/// Converts an orientation of FRD axes in NED to the orientation of the same body's FLU axes in ENU.
SONAR_HD inline Quatd enu_flu_from_ned_frd(Quatd frd_in_ned) {
  const double h = std::sqrt(0.5);
  const Quatd ned_in_enu{0, h, h, 0};
  const Quatd flu_in_frd{0, 1, 0, 0};
  return ned_in_enu * frd_in_ned * flu_in_frd;
}
SONAR_HD inline Pose enu_flu_from_ned_frd(const Pose& p) {
  return {enu_from_ned(p.position_m), enu_flu_from_ned_frd(p.orientation)};
}
/// Converts the pose of one FRD frame in another, such as a mount, to the pose between the same frames with FLU axes.
SONAR_HD inline Pose flu_from_frd(const Pose& p) {
  return {flu_from_frd(p.position_m), Quatd{p.orientation.w, p.orientation.x, -p.orientation.y, -p.orientation.z}};
}
/// Returns the compass heading [rad], clockwise from north (world +y), of a body-to-world orientation.
SONAR_HD inline double heading_rad(Quatd body_in_world) {
  const Vec3d ahead = rotate(body_in_world, Vec3d{1, 0, 0});
  const double h = std::atan2(ahead.x, ahead.y);
  return h < 0 ? h + 2 * pi : h;
}

inline bool is_finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
inline bool is_finite(Quatd q) { return std::isfinite(q.w) && std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z); }

}  // namespace sonar
