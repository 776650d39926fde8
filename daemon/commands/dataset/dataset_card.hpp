// README.md of a data set and of its exports. The head is YAML that the Hugging Face hub reads.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/commands/dataset/dataset_job.hpp"

namespace sonar::dataset {

struct FilesOfSplit {
  std::string split;               // "train"
  std::vector<std::string> paths;  // "shard-*.tar"
};
/// Returns the YAML head with its "---" lines. `files` may be empty.
std::string card_head(const DatasetJob& job, const std::vector<FilesOfSplit>& files, bool is_webdataset);

struct Statistics {
  const nlohmann::json& pixels;                           // samples by class
  const std::map<std::string, std::uint64_t>& instances;  // visible things, by class
  std::uint64_t negatives = 0;
  bool has_contact_sheet = false;
};
std::string dataset_card(const DatasetJob& job, const Statistics& statistics, const std::string& instruction_set);

}  // namespace sonar::dataset
