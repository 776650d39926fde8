// The keys by which configurations and render files name trajectory files, and the files themselves.
// Readers over strict_yaml cursors; errors, also of the files, are returned by the document's finish().
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <string>

#include "core/motion/playback.hpp"
#include "core/motion/trajectory_file.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {

/// Asks for `file`, `format`, `frame`, `rate_hz` and `body`.
struct TrajectoryKeys {
  explicit TrajectoryKeys(text::Map& map);
  text::Node file, format, frame, rate_hz, body;
};

/// Reads each file once, however many bodies are in it.
class TrajectoryFiles {
 public:
  /// Relative files start in `folder`.
  explicit TrajectoryFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Named {
    std::string name;                                    // for errors
    std::shared_ptr<const motion::TrajectoryFile> file;  // null after an error, which is reported
  };
  Named read(const text::Node& file, const motion::ReadOptions& options);
  Named read(const TrajectoryKeys& keys);

  /// Reads a body's plan: `none`, a file, or a map of the keys above with `speed`, `loop` and `start_s`. `body`: the body to use
  /// if the file has several and none is named. With `orbits`, the word `orbit` is permitted, and sets it.
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
