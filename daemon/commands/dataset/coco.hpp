// Writes annotations in COCO's format (cocodataset.org, "Data format": object detection), without holding all in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/base/result.hpp"
#include "daemon/commands/dataset/dataset_job.hpp"

namespace sonar::dataset {

/// Number of visible things by class.
using Instances = std::map<std::string, std::uint64_t>;
/// Adds the things listed in a shard's notes (parts.hpp).
void count_instances(const nlohmann::json& part, Instances& instances);

struct CocoFile {
  std::filesystem::path file;
  const Instances& instances;  // instances of the whole set, so that categories have the same numbers in every split
  std::function<std::string(std::uint64_t ping)> name_of;
  std::function<bool(const nlohmann::json& image)> is_in;  // selects images of the parts
};
/// Writes the annotations from the notes of the shards, which are read twice, one at a time.
Result<void> write_coco(const DatasetJob& job, const std::filesystem::path& set, const CocoFile& coco);

}  // namespace sonar::dataset
