// The job of a data set: a render file (docs/render.md) whose values vary from ping to ping. A ping is a function of its
// number, the job's text and the files that the job names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/dataset/vary.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar {
class ShapeCache;
}
namespace sonar::dataset {

inline constexpr std::uint64_t most_pings = 100'000'000, most_shard_pings = 100'000;

struct DatasetJob {
  std::string source, text;
  std::filesystem::path folder;  // relative paths begin here
  std::string name, about, license;
  Seed seed{};
  std::uint64_t pings = 0, shard_pings = 1024;
  double negatives = 0;              // fraction of pings without targets
  std::vector<std::string> targets;  // names or labels of objects
  bool fan = false;                  // true: also write a picture of each ping
  std::vector<Variation> variations;
  std::vector<std::pair<std::string, std::string>> formulas;  // formulas of `let`, as written
  Constraints constraints;

  std::uint64_t shards() const { return (pings + shard_pings - 1) / shard_pings; }
};

/// Errors have the form file:line:col: key.path: cause.
Result<DatasetJob> load_job(const std::filesystem::path& file);
Result<DatasetJob> parse_job(std::string text, const std::string& name, const std::filesystem::path& folder);

/// A file that a job names.
struct NamedFile {
  std::string word;            // as written in the job
  std::filesystem::path file;  // path, in the folder of the file that names it
  std::string digest;          // SHA-256, or "unreadable"
};
/// Returns all files that a ping may use: each word of the job's text, or of a YAML file found in this way, that names a file.
std::vector<NamedFile> named_files(const DatasetJob& job);

/// A ping that met the constraints.
struct DrawnPing {
  render::RenderJob job;
  Draws draws;
  std::uint32_t attempt = 0;
  bool negative = false;
  std::string scene_key;                     // scenes with equal keys are equal
  std::shared_ptr<const Scene> whole_scene;  // includes the objects that counts and negatives hide
};

/// The last scene, which is reused if the next one is equal, and all shapes read so far.
struct KnownScene {
  std::string key = {};
  std::shared_ptr<const Scene> scene = {};
  ShapeCache* shapes = nullptr;
};
/// Draws until the constraints are met. Errors: config if no draw meets them, or if the filled file is wrong.
Result<DrawnPing> draw_ping(const DatasetJob& job, std::uint64_t number, const KnownScene& known = {});

/// Returns everything on which the ping depends.
PingRequest request_of(const DrawnPing& ping, std::uint64_t number);

}  // namespace sonar::dataset
