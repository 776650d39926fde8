#include "daemon/commands/dataset/parts.hpp"

#include <algorithm>
#include <fstream>

#include "core/text/format.hpp"
#include "daemon/commands/dataset/shards.hpp"

namespace sonar::dataset {

using nlohmann::json;
using std::filesystem::path;

std::string ping_key(std::uint64_t number) { return text::format("%010llu", static_cast<unsigned long long>(number)); }

path part_file(const path& set, std::uint64_t shard) { return set / path(shard_name(shard)).replace_extension(".json"); }

json read_json(const path& file) {
  std::ifstream in(file);
  return json::parse(in, nullptr, false);
}

Result<json> read_part(const path& set, std::uint64_t shard) {
  json part = read_json(part_file(set, shard));
  const auto is_complete = [](const json& image) {
    return image.is_object() && image.contains("annotations") && image.contains("scene");
  };
  if (part.is_object() && part.contains("pixels") && part.contains("images") && part["images"].is_array() &&
      std::ranges::all_of(part["images"], is_complete))
    return part;
  return failure(ErrorKind::bad_data,
                 part_file(set, shard).string() + " cannot be read; remove it, and run the same command again");
}

}  // namespace sonar::dataset
