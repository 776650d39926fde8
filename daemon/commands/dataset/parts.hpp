// The notes beside each shard, shard-NNNNNN.json: facts of its pings for the manifest, the COCO file and the exports.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/result.hpp"

namespace sonar::dataset {

/// "0000000123", the name of a ping in its shard.
std::string ping_key(std::uint64_t number);
std::filesystem::path part_file(const std::filesystem::path& set, std::uint64_t shard);

/// `pixels`: samples by class; `images`: by ping `id`, `width`, `height`, `negative`, `scene` (equal for equal scenes), `draws`
/// and `annotations`. Errors: bad_data if it cannot be read.
Result<nlohmann::json> read_part(const std::filesystem::path& set, std::uint64_t shard);

nlohmann::json read_json(const std::filesystem::path& file);

}  // namespace sonar::dataset
