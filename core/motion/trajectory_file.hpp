// Reads trajectory files: CSV with our header, TUM, EuRoC CSV and KITTI matrices (docs/poses.md). The result has our axes (ENU,
// FLU) and times from the start of the file.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/geodesy.hpp"
#include "core/base/plausible_angles.hpp"
#include "core/base/result.hpp"
#include "core/motion/trajectory.hpp"

namespace sonar::motion {

enum class Format { automatic, csv, tum, euroc, kitti };
enum class Frame { enu_flu, ned_frd };  // axes of the world and of the body
std::string_view name_of(Format format);
std::string_view name_of(Frame frame);

struct ReadOptions {
  Format format = Format::automatic;   // automatic: recognised from the first line with numbers or names
  std::optional<Frame> frame = {};     // required if the file does not state it; an error if the file states a different one
  std::optional<double> rate_hz = {};  // lines per second; only for KITTI files, which have no times
  bool operator==(const ReadOptions&) const = default;
};

struct TrajectoryFile {
  struct Body {
    std::string name;  // empty if the file has no names
    std::shared_ptr<const Trajectory> trajectory;
    ImplausibleAngle largest_angle = {};  // largest of all poses; found only if the columns of angles are radians
  };
  std::vector<Body> bodies;  // bodies in the order of the file; at least one
  Format format = Format::csv;
  Frame frame = Frame::enu_flu;
  std::optional<Geodetic> origin = {};  // position of 0, 0, 0, if a comment states it
  Ns begins_at{0};                      // the earliest stamp, which is time 0 in the trajectories
  Ns duration{0};                       // time from the earliest to the latest stamp of the file
  std::size_t replaced = 0;             // poses that were replaced by a later line with the same stamp
  std::string_view unit = "seconds";    // unit of the stamps in the file
  bool unit_by_steps = false;  // true: the file does not name the unit, and the steps show another than is usual for the format
};

/// Reads a trajectory file. Comments in the file can state the frame, `# frame: NED_FRD`, and the position of 0, 0, 0 in degrees,
/// `# origin: 47.6,-122.3`. Errors: "name:line: reason", or "name: reason" for the whole file.
Result<TrajectoryFile> parse_trajectories(std::string_view text, const std::string& name, const ReadOptions& options);
Result<TrajectoryFile> load_trajectories(const std::filesystem::path& file, const ReadOptions& options);
/// Returns the trajectory of the body with this name, or of the only body if the name is empty. Errors list the names of the
/// bodies.
Result<std::shared_ptr<const Trajectory>> trajectory_of(const TrajectoryFile& file, const std::string& name,
                                                        const std::string& body);

}  // namespace sonar::motion
