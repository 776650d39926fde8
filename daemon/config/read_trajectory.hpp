// Reads the keys for trajectories in configurations and render files, and the files that they name. finish() of the document
// (core/text/strict_yaml) returns all errors, including those of the files.
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <string>

#include "core/motion/trajectory.hpp"
#include "core/motion/trajectory_file.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {

/// The keys `file`, `format`, `frame`, `rate_hz` and `body`.
struct TrajectoryKeys {
  explicit TrajectoryKeys(text::Map& map);
  text::Node file, format, frame, rate_hz, body;
};

/// Reads each file once, even if several bodies use it.
class TrajectoryFiles {
 public:
  /// Relative file names are relative to `folder`.
  explicit TrajectoryFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Named {
    std::string name;                                    // name of the file in errors
    std::shared_ptr<const motion::TrajectoryFile> file;  // null after a reported error
  };
  Named read(const text::Node& file, const motion::ReadOptions& options);
  Named read(const TrajectoryKeys& keys);

  /// Reads a body's plan: `none`, a file, or a map of the keys above with `speed`, `loop` and `start_s`. `body`: the body to use
  /// if the file has several and none is named. If `orbits` is not null, the word `orbit` is allowed and sets it.
  motion::Plan read_plan(const text::Node& node, const std::string& body, bool* orbits = nullptr);

 private:
  struct Known {
    std::filesystem::path path;
    motion::ReadOptions options;
    Named named;
  };
  motion::Plan read_words(const text::Node& node, const std::string& body, bool* orbits);
  motion::Plan plan_of(const text::Node& file, const Named& named, const std::string& asked, const std::string& body);

  std::filesystem::path folder_;
  std::list<Known> known_;
};

}  // namespace sonar
