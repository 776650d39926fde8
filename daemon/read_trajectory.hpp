// The keys by which configurations and render files name a trajectory file, and the file itself.
// Readers over strict_yaml cursors; what is wrong, in the file too, is told by the document's finish().
#pragma once

#include <filesystem>
#include <string>

#include "core/motion/trajectory_file.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {

/// Asks for `file`, `format`, `frame`, `rate_hz` and `body`.
struct TrajectoryKeys {
  explicit TrajectoryKeys(text::Map& map);
  text::Node file, format, frame, rate_hz, body;
};

struct NamedTrajectoryFile {
  std::filesystem::path path;
  motion::TrajectoryFile file;  // no bodies when it could not be read
  std::string body;             // asked for by name; empty = not
};

/// Relative files start in `folder`. `keys.file` is there.
NamedTrajectoryFile read_trajectory_file(const TrajectoryKeys& keys, const std::filesystem::path& folder);

}  // namespace sonar
