#include "daemon/commands/dataset/coco.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/commands/dataset/parts.hpp"
#include "daemon/commands/dataset/shards.hpp"
#include "daemon/commands/options/sonar_version.hpp"

namespace sonar::dataset {

using nlohmann::json;

void count_instances(const json& part, Instances& instances) {
  for (const json& image : part["images"])
    for (const json& a : image["annotations"]) ++instances[a["class"].get<std::string>()];
}

/// Reads the notes twice, once for each array, so that one shard at a time is in memory.
Result<void> write_coco(const DatasetJob& job, const std::filesystem::path& set, const CocoFile& coco) {
  auto file = DurableFile::open(coco.file);
  if (!file) return tl::make_unexpected(file.error());
  json categories = json::array();
  std::map<std::string, std::size_t> id_of;
  for (const auto& [name, n] : coco.instances) {
    id_of.emplace(name, id_of.size() + 1);
    categories.push_back({{"id", id_of.size()}, {"name", name}, {"supercategory", "thing"}});
  }
  // An array of the entries that `add` makes from the notes of each ping.
  const auto write_array = [&](const std::string& begin, const auto& add) -> Result<void> {
    std::string text = begin;
    bool is_first = true;
    for (std::uint64_t shard = 0; shard < job.shards(); ++shard) {
      auto part = read_part(set, shard);
      if (!part) return tl::make_unexpected(part.error());
      for (json& image : (*part)["images"])
        if (coco.is_in(image))
          add(image, [&](const json& item) { text += (std::exchange(is_first, false) ? "" : ",") + item.dump(); });
      if (const auto done = file->write(std::exchange(text, {})); !done) return done;
    }
    return {};
  };
  const json info{{"description", job.about.empty() ? job.name : job.about},
                  {"version", render::version},
                  {"contributor", "made by sonard: synthetic"},
                  {"url", ""}};
  const json licenses = json::array({{{"id", 1}, {"name", job.license}, {"url", ""}}});
  const auto images = write_array("{\"info\":" + info.dump() + ",\"licenses\":" + licenses.dump() + ",\"images\":[",
                                  [&](const json& image, const auto& put) {
                                    const auto id = image["id"].get<std::uint64_t>();
                                    put({{"id", id},
                                         {"width", image["width"]},
                                         {"height", image["height"]},
                                         {"file_name", coco.name_of(id)},
                                         {"license", 1}});
                                  });
  if (!images) return images;
  std::uint64_t annotation = 0;
  const auto annotations = write_array("],\"annotations\":[", [&](json& image, const auto& put) {
    for (json& a : image["annotations"]) {
      a["id"] = ++annotation, a["image_id"] = image["id"], a["iscrowd"] = 0;
      const auto category = id_of.find(a["class"].get<std::string>());
      a["category_id"] = category == id_of.end() ? 0 : category->second;
      a.erase("class");
      put(a);
    }
  });
  if (!annotations) return annotations;
  if (const auto done = file->write("],\"categories\":" + categories.dump() + "}\n"); !done) return done;
  return file->commit();
}

}  // namespace sonar::dataset
