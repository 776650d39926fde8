// Converts a line of a trajectory file to a pose. The header or the format of the file defines the meaning of the columns.
// trajectory_file.cpp splits the file into lines and words and then uses this class.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/motion/trajectory.hpp"

namespace sonar::motion {

using Words = std::vector<std::string_view>;

/// Values of a line, in the frame of the file.
struct Row {
  std::int64_t stamp_ns = 0;
  Pose pose;
  Vec3d velocity_mps, angular_velocity_radps;
  std::string_view body;      // from the column "body"
  RollPitchYaw written = {};  // the angles if their columns are radians; else 0
};

/// Returns a word of a file in quotes, made printable and short for an error text.
std::string in_quotes(std::string_view word);

class Columns {
 public:
  /// Reads the header. Returns the error without the prefix "file:line: ", or nullopt.
  static std::optional<std::string> refuse_header(const Words& header, Columns& out);
  static Columns tum();
  /// `words`: 8 without velocity, 11 with velocity, 17 with velocity and the biases of an IMU, which are ignored.
  static Columns euroc(std::size_t words);
  /// Twelve numbers and no time: the first three rows of the matrix that converts points from body axes to world axes.
  static Columns kitti();

  std::size_t count() const { return count_; }
  /// Guesses the unit of the stamps if the header does not name it. Whole numbers that are too large for seconds are read as
  /// milliseconds, microseconds or nanoseconds since 1970. `words`: the first line with values.
  void guess_unit(const Words& words);
  /// False if the file does not state the unit. The unit is then that of the format, 10^power() ns.
  bool says_unit() const { return says_unit_ || matrix_; }
  int power() const { return power_; }
  void set_power(int power) { power_ = power; }
  /// Reads stamp, position and body of a line before the unit is known. The stamp stays a number of the unknown unit. False if
  /// a word is not a number.
  bool peek(const Words& words, double& stamp, Vec3d& position_m, std::string_view& of) const;
  /// Unit of the stamps: "seconds", "milliseconds", "microseconds" or "nanoseconds".
  std::string_view unit() const;
  bool has_velocity() const { return has(vx); }
  bool has_angular_velocity() const { return has(wx); }
  /// Reads a line. Returns the error, or nullopt. `words` must have count() elements.
  std::optional<std::string> refuse(const Words& words, Row& out) const;

 private:
  enum Column { t, t_ns, x, y, z, qw, qx, qy, qz, roll, pitch, yaw, vx, vy, vz, wx, wy, wz, body, columns };
  static const std::array<std::string_view, columns> long_names, short_names;

  Columns() { place_.fill(-1); }
  bool has(Column c) const { return place_[c] >= 0; }
  void put(std::span<const Column> order);
  std::optional<std::string> refuse_set() const;
  std::optional<std::string> refuse_stamp(const Words& words, Row& out) const;
  std::optional<std::string> refuse_orientation(const Words& words, Row& out) const;
  std::optional<std::string> refuse_matrix(const Words& words, Row& out) const;
  std::optional<std::string> refuse_vector(const Words& words, Column first, const char* what, Vec3d& out) const;
  std::string_view word(const Words& words, Column c) const { return words[static_cast<std::size_t>(place_[c])]; }

  std::array<int, columns> place_{};
  int power_ = 9;  // a stamp is a number of 10^power_ ns
  bool says_unit_ = false, radians_ = false;
  std::size_t count_ = 0;
  bool matrix_ = false;
};

}  // namespace sonar::motion
