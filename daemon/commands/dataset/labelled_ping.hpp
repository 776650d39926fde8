// Makes the files of one ping of a data set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>

#include "core/base/parallel.hpp"
#include "core/base/result.hpp"
#include "core/image/raster.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/scene/files/shape_cache.hpp"
#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/commands/dataset/dataset_job.hpp"

namespace sonar::dataset {

// Makes the contact sheet of a data set: the picture of each ping beside its labels.

/// Returns the numbers of the pings that the sheet shows, spread over the set.
std::vector<std::uint64_t> pings_on_sheet(std::uint64_t pings);

/// Draws the fan, and beside it the same fan dimmed, with things in a colour of their class, shadows in blue, and a box around
/// each thing. `annotations`: made by render::annotations_of(). The ping must have labels. Returns nullopt for a ping of one
/// beam.
Result<std::optional<Raster>> contact_cell(const Ping& ping, const Scene& scene, const nlohmann::json& annotations);

/// Joins the cells to one picture; `cells` must not be empty.
Raster contact_sheet(const std::vector<Raster>& cells);

struct LabelledPing {
  std::vector<std::pair<std::string, std::vector<std::byte>>> files;  // ending and contents
  nlohmann::json annotations;                                         // made by render::annotations_of
  nlohmann::json pixels;                                              // number of samples of each class
  int width = 0, height = 0;                                          // numbers of beams and rows
  bool negative = false;
  std::string scene;           // digest of scene_key
  nlohmann::json draws;        // names and words of the draws
  std::optional<Raster> cell;  // picture of a ping on the contact sheet
};

/// Makes pings in sequence on one thread, with one engine, whose scene is changed when a ping has another scene.
class PingMaker {
 public:
  /// `simd`, if set, replaces the instruction set of the job.
  PingMaker(const DatasetJob& job, std::string inputs, std::optional<SimdLevel> simd)
      : job_(job), inputs_(std::move(inputs)), simd_(simd) {}
  Result<LabelledPing> make(std::uint64_t number);
  /// Makes the ping and returns its contact_cell().
  Result<std::optional<Raster>> cell(std::uint64_t number);

 private:
  Result<DrawnPing> compute(std::uint64_t number, Ping& ping);

  const DatasetJob& job_;
  std::string inputs_;
  std::optional<SimdLevel> simd_;
  std::vector<std::uint64_t> on_sheet_ = pings_on_sheet(job_.pings);
  Parallel one_{1};
  ShapeCache shapes_;
  KnownScene known_{.shapes = &shapes_};
  std::string engine_key_;
  std::unique_ptr<ChangingEngine> engine_;
};

}  // namespace sonar::dataset
