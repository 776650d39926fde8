// Resolves the name of a scene: a file on disk, else a scene built into the program.
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "core/motion/trajectory.hpp"
#include "core/motion/trajectory_file.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {

struct SceneFile {
  std::filesystem::path path;
  bool built_in = false;  // `path` is one of built_in_scenes; no file is read

  std::string name() const { return (built_in ? "built-in " : "") + path.string(); }
};

/// Searches `directory`, then the shipped scenes on disk, then the built-in ones.
std::optional<SceneFile> find_scene(const std::filesystem::path& given, const std::filesystem::path& directory);
/// Returns the folders that find_scene() searches, for error texts, such as "., A and B".
std::string scene_folders(const std::filesystem::path& directory);

/// True if the name ends in .yaml or .yml; for names from control clients.
bool has_scene_name(const std::filesystem::path& given);
/// True if errors that quote the file may be sent to control clients: only for files in `directory` (the configuration's) and for
/// the shipped scenes, after resolving links.
bool may_be_quoted(const SceneFile& file, const std::filesystem::path& directory);

/// Loads a scene. `world_origin`: the configuration's origin, for grids with latitudes and longitudes. The function is inline, so
/// that code without scenes does not need the scene loader and its libraries.
inline Result<std::shared_ptr<const Scene>> load_scene(const SceneFile& file, const std::optional<Geodetic>& world_origin = {}) {
  return file.built_in ? load_built_in_scene(file.path.string()) : load_scene(file.path, world_origin);
}

// Suggests the closest scene name that find_scene() would find, for errors of configurations and render files.

/// Returns a similar name that find_scene() finds in `directory`; empty if there is none.
std::string nearest_scene(const std::filesystem::path& given, const std::filesystem::path& directory);

// Reads the keys for trajectories in configurations and render files, and the files that they name. finish() of the document
// (core/text/strict_yaml) returns all errors, including those of the files.

/// The keys `file`, `format`, `frame`, `rate_hz` and `body`.
struct TrajectoryKeys {
  explicit TrajectoryKeys(text::Map& map);
  text::Node file, format, frame, rate_hz, body;
};

/// Returns a plan that plays one of the file's trajectories from its start. `name`: the file, as the user wrote it.
motion::Plan plan_for(const motion::TrajectoryFile& file, std::shared_ptr<const motion::Trajectory> trajectory,
                      const std::string& name);

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
