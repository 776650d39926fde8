// Reads files of trajectories: our CSV with a header, TUM, EuRoC CSV and KITTI matrices (docs/poses.md). Used by `sonard run` and
// `sonard render`. The result is in our frames, with times from the start of the file.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/motion/trajectory.hpp"

namespace sonar::motion {

enum class Format { automatic, csv, tum, euroc, kitti };
enum class Frame { enu_flu, ned_frd };  // axes of the world and of the body
std::string_view name_of(Format format);
std::string_view name_of(Frame frame);

struct ReadOptions {
  Format format = Format::automatic;   // found from the first line with numbers or names
  std::optional<Frame> frame = {};     // needed when the file does not name it; a file that names another is refused
  std::optional<double> rate_hz = {};  // lines a second; of KITTI files, which have no times, and of no others
  bool operator==(const ReadOptions&) const = default;
};

struct TrajectoryFile {
  struct Body {
    std::string name;  // empty when the file names none
    std::shared_ptr<const Trajectory> trajectory;
  };
  std::vector<Body> bodies;  // bodies in the order of the file; at least one
  Format format = Format::csv;
  Frame frame = Frame::enu_flu;
  Ns begins_at{0};                    // the earliest stamp: what the trajectories call 0
  Ns duration{0};                     // time to the latest stamp
  std::size_t replaced = 0;           // poses that a later line of the same stamp took the place of
  std::string_view unit = "seconds";  // of the stamps in the file
};

/// A comment of the file says its frame: `# frame: NED_FRD`. Errors: name:line: what.
Result<TrajectoryFile> parse_trajectories(std::string_view text, const std::string& name, const ReadOptions& options);
Result<TrajectoryFile> load_trajectories(const std::filesystem::path& file, const ReadOptions& options);
/// Trajectory of the body of that name; with an empty name, of the only one. Errors name the bodies there are.
Result<std::shared_ptr<const Trajectory>> trajectory_of(const TrajectoryFile& file, const std::string& name,
                                                        const std::string& body);

}  // namespace sonar::motion
