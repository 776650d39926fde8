#include "daemon/commands/dataset/make_dataset.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/parallel.hpp"
#include "core/base/regular_file.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "daemon/commands/dataset/dataset_card.hpp"
#include "daemon/commands/dataset/labelled_ping.hpp"
#include "daemon/commands/dataset/shards.hpp"
#include "daemon/commands/options/sonar_version.hpp"
#include "daemon/commands/render/sidecar.hpp"

namespace sonar::dataset {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::uint64_t pings_per_thread = 4;  // pings of a batch, which wait in memory until they are written in order

constexpr std::array<std::string_view, 5> own_names{"job.json", "README.md", "manifest.json", "coco.json", "contact.png"};

/// Return the file for the pings of an incomplete shard, and the file for the notes on them.
path aside_file(const path& out, std::uint64_t shard) { return out / path(shard_name(shard)).replace_extension(".aside"); }
path aside_note(const path& out, std::uint64_t shard) { return aside_file(out, shard).string() + ".json"; }

class Folder final : public DatasetFolder {
 public:
  Folder(const DatasetJob& job, const DatasetOptions& options, OnProgress on_progress)
      : job_(job), o_(options), on_progress_(std::move(on_progress)), pool_(options.threads) {}

  // First finds the shards that are missing, so that the progress counts the pings that are still to be made.
  Result<DatasetProgress> make_all() {
    std::vector<std::uint64_t> missing;
    for (std::uint64_t shard = o_.part; shard < job_.shards(); shard += o_.parts) {
      const auto is_there = holds(shard);
      if (!is_there) return tl::make_unexpected(is_there.error());
      ++progress_.all_shards;
      if (*is_there)
        ++progress_.shards, ++progress_.kept_shards;
      else
        missing.push_back(shard), progress_.all_pings += end_of(shard) - first_of(shard);
    }
    for (const std::uint64_t shard : missing)
      if (const auto r = make(shard); progress_.stopped)
        return progress_;
      else if (!r)
        return tl::make_unexpected(r.error());
    return conclude();
  }

  const std::string& inputs() const override { return inputs_; }
  const std::string& instruction_set() const override { return instruction_set_; }
  bool differs() const override { return differs_; }

  /// Checks that the folder belongs to this job, or makes it the folder of this job.
  Result<void> claim() {
    const auto first = draw_ping(job_, 1);  // reports mistakes of the job before the folder is made
    if (!first) return tl::make_unexpected(first.error());
    instruction_set_ = simd::kernels_for(o_.simd.value_or(first->job.config.engine.simd)).name;
    Sha256 files;
    for (const NamedFile& named : named_files(job_))
      for (const std::string& text : {named.word, named.digest}) files.add(std::as_bytes(std::span(text)));
    inputs_ = render::digest_of({job_.source, {first->job}, job_.text + instruction_set_ + files.hex()}, 0, job_.fan);
    for (int i = 0; i < pool_.threads(); ++i) makers_.push_back(std::make_unique<PingMaker>(job_, inputs_, o_.simd));
    std::error_code ec;
    std::filesystem::create_directories(o_.out, ec);
    if (ec)
      return failure(ErrorKind::io, "cannot make the folder " + o_.out.string() + ": " + ec.message() + "; choose another --out");
    const path about = o_.out / "job.json";
    const std::string foreign =
        own_file_in(o_.out);  // searched before job.json, because another process may begin the folder at this moment
    if (!std::filesystem::exists(about, ec)) {
      if (!foreign.empty())
        return failure(ErrorKind::usage, (o_.out / foreign).string() +
                                             " may not be from sonard: the folder has no job.json; it is not overwritten: choose "
                                             "another --out");
      const json words{{"sonard", render::version},
                       {"inputs", inputs_},
                       {"from", job_.source},
                       {"job", job_.text},
                       {"instruction_set", instruction_set_}};
      auto file = DurableFile::open(about);
      if (!file) return tl::make_unexpected(file.error());
      if (const auto done = file->write(words.dump(1) + "\n"); !done) return done;
      // Another process may have begun the same folder meanwhile.
      if (const auto is_new = file->commit_new(); !is_new) return tl::make_unexpected(is_new.error());
    }
    const json there = read_json(about);
    if (!there.is_object() || there.value("inputs", "") != inputs_)
      return failure(ErrorKind::usage, o_.out.string() +
                                           " holds shards of another job, program version or instruction set (job.json); "
                                           "choose another --out");
    remove_unfinished(o_.out, [&](const std::string& name) { return is_own(name); });
    return {};
  }

  /// If a run was killed after the rename of a shard but before its digest was written, the digest is written now.
  Result<bool> holds(std::uint64_t shard) override {
    differs_ = false;
    const path file = o_.out / shard_name(shard), noted = file.string() + ".sha256";
    std::error_code ec;
    if (!std::filesystem::exists(file, ec) || !std::filesystem::exists(part_file(o_.out, shard), ec)) return false;
    const auto digest = digest_of_file(file);
    if (!digest) return tl::make_unexpected(digest.error());
    const std::string line = *digest + "  " + file.filename().string() + "\n";
    if (is_absent(noted)) {
      if (const auto done = write_durably(noted, line); !done) return tl::make_unexpected(done.error());
      return true;
    }
    const auto there = read_regular(noted, line.size());
    if (!there) return tl::make_unexpected(there.error());
    if (*there == line) return true;
    differs_ = true;
    return failure(ErrorKind::bad_data, file.string() + " differs from " + noted.filename().string() +
                                            ": it was changed or damaged; remove both, and run the same command again");
  }

  // Pings of a batch are computed in parallel and written in order, so the bytes do not depend on the number of threads.
  Result<void> make(std::uint64_t shard) override {
    differs_ = false;
    json part{{"images", json::array()}, {"pixels", json::object()}};
    auto tar = begin(shard, part);
    if (!tar) return tl::make_unexpected(tar.error());
    const std::uint64_t at_once = pings_per_thread * static_cast<std::uint64_t>(pool_.threads());
    for (std::uint64_t from = first_of(shard) + part["images"].size(); from < end_of(shard); from += at_once) {
      const auto count = static_cast<std::size_t>(std::min(at_once, end_of(shard) - from));
      std::vector<std::optional<Result<LabelledPing>>> made(count);
      pool_.for_each(count, [&](std::size_t i, int worker) {
        if (!is_stopped()) made[i] = makers_[static_cast<std::size_t>(worker)]->make(from + i);
      });
      for (std::size_t i = 0; i < count; ++i) {
        if (!made[i]) return set_aside(shard, *tar, part);
        if (!*made[i]) return tl::make_unexpected(made[i]->error());
        if (const auto done = add(from + i, **made[i], *tar, part); !done) return done;
      }
      on_progress_(progress_);
    }
    // The notes are written first, so a shard is complete if the archive has its final name.
    if (const auto done = write_durably(part_file(o_.out, shard), part.dump() + "\n"); !done) return done;
    progress_.bytes += tar->bytes();
    if (const auto done = tar->commit(); !done) {
      differs_ = done.error().kind == ErrorKind::bad_data;
      return tl::make_unexpected(done.error());
    }
    std::error_code ec;
    std::filesystem::remove(aside_note(o_.out, shard), ec);
    std::filesystem::remove(aside_file(o_.out, shard), ec);
    ++progress_.shards;
    on_progress_(progress_);
    return {};
  }

  /// Only the notes of one shard at a time are in memory.
  Result<DatasetProgress> conclude() override {
    json shards = json::array(), pixels = json::object();
    std::uint64_t negatives = 0;
    Instances instances;
    std::error_code ec;
    for (std::uint64_t shard = 0; shard < job_.shards(); ++shard) {
      std::ifstream in(o_.out / (shard_name(shard) + ".sha256"));
      std::string digest;
      if (!(in >> digest) || !std::filesystem::exists(o_.out / shard_name(shard), ec) ||
          !std::filesystem::exists(part_file(o_.out, shard), ec)) {
        progress_.missing = shard;
        return progress_;
      }
      shards.push_back({{"name", shard_name(shard)}, {"sha256", digest}, {"pings", end_of(shard) - first_of(shard)}});
      const auto part = read_part(o_.out, shard);
      if (!part) return tl::make_unexpected(part.error());
      for (const auto& [name, n] : (*part)["pixels"].items())
        pixels[name] = pixels.value(name, std::uint64_t{0}) + n.get<std::uint64_t>();
      for (const json& image : (*part)["images"]) negatives += image["negative"].get<bool>() ? 1 : 0;
      count_instances(*part, instances);
    }
    const auto name_of = [&](std::uint64_t id) {
      return shard_name((id - 1) / job_.shard_pings) + "/" + ping_key(id) + ".samples.png";
    };
    if (const auto done = write_coco(job_, o_.out, {o_.out / "coco.json", instances, name_of, [](const json&) { return true; }});
        !done)
      return tl::make_unexpected(done.error());
    const auto has_contact_sheet = write_contact_sheet();
    if (!has_contact_sheet) return tl::make_unexpected(has_contact_sheet.error());
    const std::string card = dataset_card(job_, {pixels, instances, negatives, *has_contact_sheet}, instruction_set_);
    if (const auto done = write_durably(o_.out / "README.md", card); !done) return tl::make_unexpected(done.error());
    const json manifest{{"name", job_.name},
                        {"about", job_.about},
                        {"license", job_.license},
                        {"sonard", render::version},
                        {"instruction_set", instruction_set_},
                        {"inputs", inputs_},
                        {"job", job_.text},
                        {"seed", static_cast<std::uint64_t>(job_.seed)},
                        {"pings", job_.pings},
                        {"shards", shards}};
    if (const auto done = write_durably(o_.out / "manifest.json", manifest.dump(1) + "\n"); !done)
      return tl::make_unexpected(done.error());
    progress_.whole = true;
    return progress_;
  }

 private:
  std::uint64_t first_of(std::uint64_t shard) const { return shard * job_.shard_pings + 1; }
  std::uint64_t end_of(std::uint64_t shard) const { return std::min((shard + 1) * job_.shard_pings, job_.pings) + 1; }

  /// Returns the first file in the folder, except job.json, that has a name of a data set file; empty if there is none.
  static std::string own_file_in(const path& folder) {
    std::error_code ec;
    std::string first;
    for (std::filesystem::directory_iterator entry(folder, ec), end; !ec && entry != end; entry.increment(ec)) {
      const std::string name = entry->path().filename().string();
      if (name == "job.json") continue;
      const bool is_own = name.starts_with("shard-") || std::find(own_names.begin(), own_names.end(), name) != own_names.end();
      if (is_own && (first.empty() || name < first)) first = name;
    }
    return first;
  }

  /// True for a shard of this part; without parts, for every file of a data set.
  bool is_own(const std::string& name) const {
    unsigned long long shard = 0;
    if (std::sscanf(name.c_str(), "shard-%llu.", &shard) == 1) return shard % o_.parts == o_.part;
    return o_.parts == 1 && std::find(own_names.begin(), own_names.end(), name) != own_names.end();
  }

  bool is_stopped() const { return o_.stop != nullptr && *o_.stop; }

  /// Opens the archive of the shard. The archive and `part` then contain the pings that an interrupted run set aside.
  Result<ShardWriter> begin(std::uint64_t shard, json& part) {
    auto tar = ShardWriter::open(o_.out / shard_name(shard));
    if (!tar) return tar;
    json there = read_json(aside_note(o_.out, shard));
    if (!there.is_object() || !there.contains("part") || there["part"]["images"].size() > end_of(shard) - first_of(shard))
      return tar;
    const auto goes_on = tar->go_on(aside_file(o_.out, shard), there.value("sha256", ""));
    if (!goes_on) return tl::make_unexpected(goes_on.error());
    if (!*goes_on) return tar;
    part = std::move(there["part"]);
    progress_.all_pings -= std::min<std::uint64_t>(progress_.all_pings, part["images"].size());
    return tar;
  }

  Result<void> add(std::uint64_t number, LabelledPing& ping, ShardWriter& tar, json& part) {
    for (const auto& [ending, contents] : ping.files)
      if (const auto done = tar.add(ping_key(number) + "." + ending, contents); !done) return done;
    for (const auto& [name, n] : ping.pixels.items())
      part["pixels"][name] = part["pixels"].value(name, std::uint64_t{0}) + n.get<std::uint64_t>();
    part["images"].push_back({{"id", number},
                              {"width", ping.width},
                              {"height", ping.height},
                              {"negative", ping.negative},
                              {"scene", std::move(ping.scene)},
                              {"draws", std::move(ping.draws)},
                              {"annotations", std::move(ping.annotations)}});
    if (ping.cell) cells_.insert_or_assign(number, *std::move(ping.cell));
    ++progress_.pings;
    return {};
  }

  /// Keeps the pings of a shard that is not complete, when the run is stopped.
  Result<void> set_aside(std::uint64_t shard, ShardWriter& tar, const json& part) {
    progress_.stopped = true;
    progress_.set_aside = part["images"].size();
    if (progress_.set_aside == 0) return {};
    const auto digest = tar.set_aside(aside_file(o_.out, shard));
    if (!digest) return tl::make_unexpected(digest.error());
    return write_durably(aside_note(o_.out, shard), json{{"sha256", *digest}, {"part", part}}.dump() + "\n");
  }

  /// Writes a sheet of the pings that have more than one beam; false if there are none.
  Result<bool> write_contact_sheet() {
    std::vector<Raster> cells;
    for (const std::uint64_t number : pings_on_sheet(job_.pings)) {
      if (const auto kept = cells_.find(number); kept != cells_.end()) {
        cells.push_back(kept->second);
        continue;
      }
      auto cell = makers_.front()->cell(number);  // cell of a ping that another run made
      if (!cell) return tl::make_unexpected(cell.error());
      if (*cell) cells.push_back(**std::move(cell));
    }
    if (cells.empty()) return false;
    const auto png = encode_png(contact_sheet(cells));
    if (!png) return tl::make_unexpected(png.error());
    const std::string_view bytes(reinterpret_cast<const char*>(png->data()), png->size());
    if (const auto done = write_durably(o_.out / "contact.png", bytes); !done) return tl::make_unexpected(done.error());
    return true;
  }

  const DatasetJob& job_;
  const DatasetOptions o_;
  const OnProgress on_progress_;
  Parallel pool_;
  std::string inputs_, instruction_set_;
  std::vector<std::unique_ptr<PingMaker>> makers_;  // one per thread
  std::map<std::uint64_t, Raster> cells_;           // cells of the contact sheet that this run has made so far
  DatasetProgress progress_;
  bool differs_ = false;
};

Result<std::unique_ptr<Folder>> open_folder(const DatasetJob& job, const DatasetOptions& options, OnProgress on_progress) {
  auto folder = std::make_unique<Folder>(job, options, std::move(on_progress));
  if (const auto done = folder->claim(); !done) return tl::make_unexpected(done.error());
  return folder;
}

}  // namespace

Result<std::unique_ptr<DatasetFolder>> open_dataset(const DatasetJob& job, const DatasetOptions& options,
                                                    OnProgress on_progress) {
  return open_folder(job, options, std::move(on_progress));
}

Result<DatasetProgress> make_dataset(const DatasetJob& job, const DatasetOptions& options, OnProgress on_progress) {
  auto folder = open_folder(job, options, std::move(on_progress));
  if (!folder) return tl::make_unexpected(folder.error());
  return (*folder)->make_all();
}

}  // namespace sonar::dataset
