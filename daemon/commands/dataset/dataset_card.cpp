#include "daemon/commands/dataset/dataset_card.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/base/letters.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/dataset/shards.hpp"
#include "daemon/commands/options/sonar_version.hpp"

namespace sonar::dataset {
namespace {

using nlohmann::json;

/// Returns a YAML string in double quotes, which has the syntax of a JSON string.
std::string quoted(const std::string& text) { return json(text).dump(-1, ' ', false, json::error_handler_t::replace); }

/// Returns the licence for the card's metadata. A licence without an identifier of the Hugging Face hub is `other`, with a
/// `license_name`.
std::string license_lines(const std::string& license) {
  constexpr std::array<std::string_view, 14> known{
      "cc0-1.0",    "cc-by-4.0",    "cc-by-sa-4.0", "cc-by-nc-4.0", "cc-by-nd-4.0", "cc-by-nc-sa-4.0", "cc-by-nc-nd-4.0", "mit",
      "apache-2.0", "bsd-3-clause", "gpl-3.0",      "odbl",         "pddl",         "unlicense"};
  if (license == "not stated") return "license: unknown\n";
  const std::string small = small_letters(license);
  if (std::ranges::find(known, small) != known.end()) return "license: " + small + "\n";
  return "license: other\nlicense_name: " + quoted(license) + "\n";
}

std::string_view size_category(std::uint64_t pings) {
  if (pings < 1'000) return "n<1K";
  if (pings < 10'000) return "1K<n<10K";
  if (pings < 100'000) return "10K<n<100K";
  if (pings < 1'000'000) return "100K<n<1M";
  return pings < 10'000'000 ? "1M<n<10M" : "10M<n<100M";
}

}  // namespace

std::string card_head(const DatasetJob& job, const std::vector<FilesOfSplit>& files, bool is_webdataset) {
  std::string head = "---\npretty_name: " + quoted(job.name) + "\n" + license_lines(job.license) +
                     "task_categories:\n- object-detection\n- image-segmentation\nsize_categories:\n- " +
                     std::string(size_category(job.pings)) + "\ntags:\n- sonar\n- underwater\n- synthetic\n" +
                     (is_webdataset ? "- webdataset\n" : "");
  if (!files.empty()) head += "configs:\n- config_name: default\n  data_files:\n";
  for (const auto& [split, paths] : files) {
    head += "  - split: " + split + "\n    path:\n";
    for (const std::string& path : paths) head += "    - " + quoted(path) + "\n";
  }
  return head + "---\n";
}

std::string dataset_card(const DatasetJob& job, const Statistics& s, const std::string& instruction_set) {
  std::string text = card_head(job, {{"train", {"shard-*.tar"}}}, true) + "# " + job.name + "\n\n" +
                     (job.about.empty() ? "" : job.about + "\n\n") + "License: " + job.license + "\n\n" +
                     std::to_string(job.pings) + " synthetic pings in " + std::to_string(job.shards()) + " shards, " +
                     std::to_string(s.negatives) + " of them without targets; made by sonard " + render::version + " (" +
                     instruction_set + ") from the job in `manifest.json`, which makes them again, byte for byte.\n\n" +
                     (s.has_contact_sheet ? "![pings beside their labels: things in a colour of their class, shadows in "
                                            "blue](contact.png)\n\n"
                                          : "") +
                     "| class | instances seen |\n|---|---|\n";
  for (const auto& [name, n] : s.instances) text += "| " + name + " | " + std::to_string(n) + " |\n";
  text += "\n| samples of | share |\n|---|---|\n";
  double all = 0;
  for (const auto& [name, n] : s.pixels.items()) all += n.get<double>();
  for (const auto& [name, n] : s.pixels.items())
    text += "| " + name + " | " + text::format("%.2f %%", 100 * n.get<double>() / all) + " |\n";
  return text +
         "\nEach ping has `samples.png`, `labels.png` (instance of each sample, 16 bits), `share.png` (the instance's share of "
         "the sample's energy, 255 = all), `caster.png` (instance that casts a shadow there) and `json` (pose, settings, "
         "water, truth, instances, boxes, values drawn at random). Rows are ordered by range; beam 0 is the one "
         "farthest to port. The echoes are simulated, not recorded: only tests on real data show how useful a model trained on "
         "them is.\n";
}

using nlohmann::json;

void count_instances(const json& part, Instances& instances) {
  for (const json& image : part["images"])
    for (const json& a : image["annotations"]) ++instances[a["class"].get<std::string>()];
}

/// Reads the notes twice, once for each array, so that only one shard at a time is in memory.
Result<void> write_coco(const DatasetJob& job, const std::filesystem::path& set, const CocoFile& coco) {
  auto file = DurableFile::open(coco.file);
  if (!file) return tl::make_unexpected(file.error());
  json categories = json::array();
  std::map<std::string, std::size_t> id_of;
  for (const auto& [name, n] : coco.instances) {
    id_of.emplace(name, id_of.size() + 1);
    categories.push_back({{"id", id_of.size()}, {"name", name}, {"supercategory", "thing"}});
  }
  // Writes an array of the entries that `add` makes from the notes of each ping.
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
