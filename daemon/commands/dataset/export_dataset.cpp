#include "daemon/commands/dataset/make_dataset.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/regular_file.hpp"
#include "core/image/raster.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "daemon/commands/dataset/dataset_card.hpp"
#include "daemon/commands/dataset/shards.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::dataset {
namespace {

using nlohmann::json;
using std::filesystem::path;

std::vector<std::string> words_of(const std::string& list) {
  std::vector<std::string> words;
  if (list.empty()) return words;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t end = std::min(list.find(',', at), list.size());
    words.push_back(list.substr(at, end - at));
    at = end + 1;
  }
  return words;
}

path export_folder(const path& set, ExportForm form) {
  return set / std::string(export_form_names[static_cast<std::size_t>(form)]);
}

tl::unexpected<Error> unknown_draw(const DatasetJob& job, const std::string& name) {
  std::vector<std::string_view> names;
  for (const Variation& v : job.variations) names.push_back(v.name);
  return failure(ErrorKind::usage,
                 "--split-by " + name + ": the job draws no such value" + text::suggestion(name, names, "values"));
}

/// Writes one export, under a temporary name until it is complete.
class Export {
 public:
  Export(const DatasetJob& job, const path& set, ExportForm form, const Split& split)
      : job_(job),
        set_(set),
        form_(form),
        split_(split),
        folder_(export_folder(set, form)),
        unfinished_(folder_.string() + ".unfinished") {}

  // An unfinished export of an earlier run is removed. The folder gets its name when it is complete.
  Result<Exported> run() {
    if (const auto able = check_export(job_, set_, form_, split_); !able) return tl::make_unexpected(able.error());
    if (const auto done = find_splits(); !done) return tl::make_unexpected(done.error());
    std::error_code ec;
    std::filesystem::remove_all(unfinished_, ec);
    for (const auto step : {&Export::make_folders, &Export::unpack, &Export::write_annotations, &Export::write_card})
      if (const auto done = (this->*step)(); !done) return tl::make_unexpected(done.error());
    std::filesystem::rename(unfinished_, folder_, ec);
    if (ec) return cannot_write(folder_, ec);
    return exported_;
  }

 private:
  tl::unexpected<Error> cannot_write(const path& file, const std::error_code& why) const {
    return failure(ErrorKind::io, "cannot write " + file.string() + ": " + why_not_written(file, why.value()) +
                                      "; then run the same command again");
  }
  bool is_there(std::size_t split) const { return exported_.pings[split] > 0; }
  path folder_of(std::size_t split) const { return unfinished_ / std::string(split_names[split]); }
  static std::string name_of(std::uint64_t ping) { return ping_key(ping) + ".png"; }

  /// Pings of a group go into one split. Without --split-by a group is a scene, so that a model is not tested on a scene that it
  /// was trained on; else it has equal values of these draws.
  Result<void> find_splits() {
    std::vector<std::string> groups;  // in the order of the pings
    std::vector<std::size_t> group_of;
    std::map<std::string, std::size_t> known;
    std::map<std::string, std::set<std::size_t>> groups_of;  // by scene
    for (std::uint64_t shard = 0; shard < job_.shards(); ++shard) {
      const auto part = read_part(set_, shard);
      if (!part) return tl::make_unexpected(part.error());
      count_instances(*part, instances_);
      for (const json& image : (*part)["images"]) {
        const std::string scene = image["scene"].get<std::string>();
        std::string group = split_.by.empty() ? scene : "";
        for (const std::string& name : split_.by) {
          if (!image["draws"].contains(name)) return unknown_draw(job_, name);
          group += image["draws"][name].dump() + ",";
        }
        const auto [place, is_new] = known.try_emplace(group, groups.size());
        if (is_new) groups.push_back(group);
        group_of.push_back(place->second);
        groups_of[scene].insert(place->second);
      }
    }
    const std::vector<std::size_t> splits = splits_of(groups, split_.shares);
    for (const std::size_t group : group_of) split_of_.push_back(splits[group]), ++exported_.pings[splits[group]];
    exported_.folder = folder_, exported_.scenes = groups_of.size();
    exported_.divided_scenes = static_cast<std::size_t>(std::ranges::count_if(groups_of, [&](const auto& scene) {
      const std::size_t first = splits[*scene.second.begin()];
      return std::ranges::any_of(scene.second, [&](std::size_t group) { return splits[group] != first; });
    }));
    return {};
  }

  Result<void> make_folders() {
    std::error_code ec;
    for (std::size_t s = 0; s < split_names.size() && !ec; ++s) {
      if (!is_there(s)) continue;
      std::filesystem::create_directories(folder_of(s), ec);
    }
    if (form_ == ExportForm::coco && !ec) std::filesystem::create_directories(unfinished_ / "annotations", ec);
    if (ec) return cannot_write(unfinished_, ec);
    return {};
  }

  Result<void> unpack() {
    for (std::uint64_t shard = 0; shard < job_.shards(); ++shard) {
      const path archive = set_ / shard_name(shard);
      const auto done = read_archive(archive, [&](const std::string& name, std::span<const std::byte> contents) -> Result<void> {
        const std::size_t dot = name.find('.');
        std::uint64_t number = 0;
        const char* const end = name.data() + std::min(dot, name.size());
        const bool is_number = std::from_chars(name.data(), end, number).ptr == end;
        if (!is_number || number < 1 || number > split_of_.size() || dot == std::string::npos)
          return failure(ErrorKind::bad_data, archive.string() + " holds " + name + ", which is not a ping of this job");
        return put(number, name.substr(dot + 1), contents);
      });
      if (!done) return done;
    }
    return {};
  }

  /// Writes one file of a ping. `ending`: for example "labels.png" or "json".
  Result<void> put(std::uint64_t ping, const std::string& ending, std::span<const std::byte> contents) {
    const path split = folder_of(split_of_[ping - 1]);
    if (form_ == ExportForm::coco)
      // COCO has all labels of a split in one file, so only pictures are unpacked.
      return ending == "samples.png" ? write_whole_file(split / name_of(ping), {contents}) : Result<void>{};
    const path folder = split / ending.substr(0, ending.find('.'));
    if (made_.insert(folder).second) {
      std::error_code ec;
      std::filesystem::create_directories(folder, ec);
      if (ec) return cannot_write(folder, ec);
    }
    return write_whole_file(folder / (ping_key(ping) + (ending == "json" ? ".json" : ".png")), {contents});
  }

  Result<void> write_annotations() {
    for (std::size_t s = 0; s < split_names.size(); ++s) {
      if (!is_there(s)) continue;
      const auto is_in = [&](const json& image) { return split_of_.at(image["id"].get<std::size_t>() - 1) == s; };
      const auto done =
          form_ == ExportForm::coco
              ? write_coco(job_, set_,
                           {.file = unfinished_ / "annotations" / ("instances_" + std::string(split_names[s]) + ".json"),
                            .instances = instances_,
                            .name_of = name_of,
                            .is_in = is_in})
              : write_metadata(s, is_in);
      if (!done) return done;
    }
    return {};
  }

  /// Writes one line per picture, in the format that the image folder loader of Hugging Face reads.
  Result<void> write_metadata(std::size_t split, const auto& is_in) {
    auto file = DurableFile::open(folder_of(split) / "metadata.jsonl");
    if (!file) return tl::make_unexpected(file.error());
    for (std::uint64_t shard = 0; shard < job_.shards(); ++shard) {
      const auto part = read_part(set_, shard);
      if (!part) return tl::make_unexpected(part.error());
      std::string lines;
      for (const json& image : (*part)["images"]) {
        if (!is_in(image)) continue;
        json objects{{"bbox", json::array()}, {"category", json::array()}, {"instance", json::array()}};
        for (const json& a : image["annotations"])
          objects["bbox"].push_back(a["bbox"]), objects["category"].push_back(a["class"]),
              objects["instance"].push_back(a["instance"]);
        lines += json{{"file_name", "samples/" + name_of(image["id"])},
                      {"labels", "labels/" + name_of(image["id"])},
                      {"negative", image["negative"]},
                      {"objects", objects}}
                     .dump() +
                 "\n";
      }
      if (const auto done = file->write(lines); !done) return done;
    }
    return file->commit();
  }

  std::string about_scenes() const {
    const std::string all = std::to_string(exported_.scenes) + " scenes ";
    const std::string by = split_.by.empty() ? "" : "Pings with equal " + text::joined(split_.by, ", ") + " are in one split. ";
    if (exported_.divided_scenes == 0) return by + "None of the " + all + "is in two splits.";
    return by + "Of the " + all + std::to_string(exported_.divided_scenes) + " have pings in two or three splits.";
  }

  Result<void> write_card() {
    std::vector<FilesOfSplit> files;
    std::string table = "| split | pings |\n|---|---|\n";
    for (std::size_t s = 0; s < split_names.size(); ++s) {
      if (!is_there(s)) continue;
      const std::string name(split_names[s]);
      files.push_back({name == "val" ? "validation" : name, {name + "/metadata.jsonl", name + "/samples/*"}});
      table += "| " + name + " | " + std::to_string(exported_.pings[s]) + " |\n";
    }
    const std::string what = form_ == ExportForm::coco ? "`annotations/instances_SPLIT.json` in COCO's form, for the pictures in "
                                                         "`SPLIT/`. x is the beam, from port, y the row, by "
                                                         "range.\n"
                                                       : "In each split: `samples/` (x is the beam, from port, y the row, by "
                                                         "range), `labels/` (instance of each sample, 16 bits), "
                                                         "`share/`, `caster/`, `json/`, and `metadata.jsonl` with the boxes.\n";
    return write_durably(unfinished_ / "README.md",
                         card_head(job_, form_ == ExportForm::folder ? files : std::vector<FilesOfSplit>{}, false) + "# " +
                             job_.name + "\n\n" + (job_.about.empty() ? "" : job_.about + "\n\n") + "License: " + job_.license +
                             "\n\n" + what + "\n" + table + "\n" + about_scenes() +
                             " The echoes are simulated, not recorded: "
                             "only tests on real data show how useful a model trained on them is.\n");
  }

  const DatasetJob& job_;
  const path set_;
  const ExportForm form_;
  const Split& split_;
  const path folder_, unfinished_;
  Instances instances_;
  std::vector<std::size_t> split_of_;  // the split of each ping
  std::set<path> made_;
  Exported exported_;
};

}  // namespace

Result<Split> parse_split(const std::string& shares, const std::string& by) {
  Split split;
  if (!shares.empty()) {
    const std::vector<std::string> words = words_of(shares);
    double sum = 0;
    for (std::size_t i = 0; i < words.size() && i < split.shares.size(); ++i) {
      const auto share = text::parse_decimal(words[i]);
      // An invalid share makes the sum infinite, which is refused below.
      split.shares[i] = share && *share >= 0 ? *share : HUGE_VAL;
      sum += split.shares[i];
    }
    if (words.size() != split.shares.size() || !(sum > 0) || !std::isfinite(sum))
      return failure(ErrorKind::usage, "--split " + shares + " is not three shares of train, val and test, such as 80,10,10");
  }
  split.by = words_of(by);
  if (std::ranges::find(split.by, "") != split.by.end())
    return failure(ErrorKind::usage, "--split-by " + by + " has an empty name: give names of draws, such as bed_seed,coat");
  return split;
}

std::vector<std::size_t> splits_of(const std::vector<std::string>& scenes, const std::array<double, 3>& shares) {
  double sum = 0;
  for (const double share : shares) sum += share;
  // Splits consist of whole scenes: shares are rounded down, then the splits with the largest remainders get one more scene. Each
  // split with a share gets at least one scene if there are enough.
  std::array<std::size_t, 3> count{};
  std::size_t left = scenes.size();
  for (std::size_t s = 0; s < count.size(); ++s) {
    count[s] = static_cast<std::size_t>(static_cast<double>(scenes.size()) * shares[s] / sum);
    left -= count[s];
  }
  const auto short_of = [&](std::size_t s) {
    return static_cast<double>(scenes.size()) * shares[s] / sum - static_cast<double>(count[s]);
  };
  for (; left > 0; --left) {
    std::size_t most = 0;
    for (std::size_t s = 1; s < count.size(); ++s)
      if (short_of(s) > short_of(most)) most = s;
    ++count[most];
  }
  for (std::size_t s = 0; s < count.size(); ++s) {
    const auto largest = static_cast<std::size_t>(std::ranges::max_element(count) - count.begin());
    if (count[s] == 0 && shares[s] > 0 && count[largest] > 1) --count[largest], ++count[s];
  }
  // Scenes are assigned in the order of the hashes of their names, which does not depend on the order of the pings.
  std::vector<std::pair<std::string, std::size_t>> order;
  for (std::size_t i = 0; i < scenes.size(); ++i) order.emplace_back(sha256_of(scenes[i]), i);
  std::ranges::sort(order);
  std::vector<std::size_t> splits(scenes.size());
  for (std::size_t s = 0, at = 0; s < count.size(); ++s)
    for (std::size_t i = 0; i < count[s]; ++i) splits[order[at++].second] = s;
  return splits;
}

Result<void> check_export(const DatasetJob& job, const path& set, ExportForm form, const Split& split) {
  std::error_code ec;
  if (const path folder = export_folder(set, form); std::filesystem::exists(folder, ec))
    return failure(ErrorKind::usage, folder.string() + " exists already; remove it to export again");
  for (const std::string& name : split.by)
    if (std::ranges::find(job.variations, name, &Variation::name) == job.variations.end()) return unknown_draw(job, name);
  return {};
}

Result<Exported> export_dataset(const DatasetJob& job, const path& set, ExportForm form, const Split& split) {
  return Export(job, set, form, split).run();
}

}  // namespace sonar::dataset
