// Makes the files of one ping of a data set.
#pragma once

#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/base/result.hpp"
#include "core/image/raster.hpp"
#include "core/pipeline/changing_engine.hpp"
#include "core/scene/files/shape_cache.hpp"
#include "daemon/commands/dataset/contact_sheet.hpp"
#include "daemon/commands/dataset/dataset_job.hpp"

namespace sonar::dataset {

struct LabelledPing {
  std::vector<std::pair<std::string, std::vector<std::byte>>> files;  // ending and contents
  nlohmann::json annotations;                                         // made by render::annotations_of
  nlohmann::json pixels;                                              // samples by class
  int width = 0, height = 0;                                          // beams, rows
  bool negative = false;
  std::string scene;           // digest of scene_key
  nlohmann::json draws;        // words
  std::optional<Raster> cell;  // picture of a ping on the contact sheet
};

/// Makes pings in sequence on one thread; reuses the engine while the scene is the same.
class PingMaker {
 public:
  /// `simd` replaces that of the job.
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
