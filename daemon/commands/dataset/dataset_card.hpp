// Makes README.md of a data set and of its exports. The head is YAML that the Hugging Face hub reads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/base/result.hpp"
#include "daemon/commands/dataset/dataset_job.hpp"

namespace sonar::dataset {

struct FilesOfSplit {
  std::string split;               // "train"
  std::vector<std::string> paths;  // "shard-*.tar"
};
/// Returns the YAML head with its "---" lines. `files` may be empty.
std::string card_head(const DatasetJob& job, const std::vector<FilesOfSplit>& files, bool is_webdataset);

struct Statistics {
  const nlohmann::json& pixels;                           // number of samples of each class
  const std::map<std::string, std::uint64_t>& instances;  // number of visible things of each class
  std::uint64_t negatives = 0;
  bool has_contact_sheet = false;
};
std::string dataset_card(const DatasetJob& job, const Statistics& statistics, const std::string& instruction_set);

// Writes annotations in COCO's format (cocodataset.org, "Data format": object detection), with one shard at a time in memory.

/// Number of visible things by class.
using Instances = std::map<std::string, std::uint64_t>;
/// Adds the things listed in a shard's notes (shards.hpp).
void count_instances(const nlohmann::json& part, Instances& instances);

struct CocoFile {
  std::filesystem::path file;
  const Instances& instances;  // instances of the whole set, so that categories have the same numbers in every split
  std::function<std::string(std::uint64_t ping)> name_of;
  std::function<bool(const nlohmann::json& image)> is_in;  // true for images that belong in the file
};
/// Writes the annotations from the notes of the shards. The notes are read twice, one shard at a time.
Result<void> write_coco(const DatasetJob& job, const std::filesystem::path& set, const CocoFile& coco);

}  // namespace sonar::dataset
