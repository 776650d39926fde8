#include "daemon/commands/farm/farm_job.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

#include "core/base/enum_names.hpp"
#include "core/base/regular_file.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "daemon/commands/dataset/shards.hpp"
#include "daemon/commands/options/sonar_version.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::farm {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t most_in_bucket = std::size_t{8} << 20;
constexpr std::size_t piece_bytes = std::size_t{512} << 10;  // less than the 1 MiB that NATS allows a message by default

constexpr std::chrono::milliseconds least_patience{100}, most_patience = std::chrono::hours(24);

/// Reads an integer field of a record and checks that the value is from `least` to `most`. json::get() would silently convert
/// other values.
Result<std::uint64_t> count_in(const json& words, const char* name, std::uint64_t least, std::uint64_t most) {
  const json& value = words.at(name);
  if (value.is_number_unsigned() && value.get<std::uint64_t>() >= least && value.get<std::uint64_t>() <= most)
    return value.get<std::uint64_t>();
  return failure(ErrorKind::bad_data,
                 std::string(name) + " is " + value.dump().substr(0, 64) +
                     (least == most ? ", not " : ", not a whole number from " + std::to_string(least) + " to ") +
                     std::to_string(most));
}

/// Reads the counts of a record, with the limits of dataset jobs.
Result<void> read_counts(const json& words, FarmJob& record) {
  const auto pings = count_in(words, "pings", 1, dataset::most_pings);
  if (!pings) return tl::make_unexpected(pings.error());
  const auto shard_pings = count_in(words, "shard_pings", 1, dataset::most_shard_pings);
  if (!shard_pings) return tl::make_unexpected(shard_pings.error());
  const std::uint64_t needed = (*pings + *shard_pings - 1) / *shard_pings;
  const auto shards = count_in(words, "shards", needed, needed);
  if (!shards) return tl::make_unexpected(shards.error());
  const auto patience = count_in(words, "patience_ms", static_cast<std::uint64_t>(least_patience.count()),
                                 static_cast<std::uint64_t>(most_patience.count()));
  if (!patience) return tl::make_unexpected(patience.error());
  record.pings = *pings, record.shard_pings = *shard_pings, record.shards = *shards;
  record.patience = std::chrono::milliseconds(*patience);
  return {};
}

std::string counts_text(std::uint64_t shards, std::uint64_t pings, std::uint64_t shard_pings) {
  return std::to_string(shards) + " shards for " + std::to_string(pings) + " pings, up to " + std::to_string(shard_pings) +
         " in each";
}

/// Returns whether a name is a relative path that stays inside its folder, in normal form, so that a file has only one name.
bool is_confined(const path& name) {
  return !name.empty() && name.is_relative() && name.lexically_normal() == name && name.has_filename() && *name.begin() != "..";
}

std::string id_of(const FarmJob& record) {
  json names = json::object();
  for (const FarmFile& f : record.files) names[f.name] = f.digest;
  return sha256_of(json{
      {"version", record.version},
      {"instruction_set", record.instruction_set},
      {"file", record.file},
      {"files", names}}.dump());
}

std::string piece_key(const std::string& digest, std::size_t piece) { return digest + "." + std::to_string(piece); }

/// Writes the file and makes its folders. Refuses if a symbolic link leads out of `folder`.
Result<void> write_below(const path& folder, const std::string& name, const std::string& bytes) {
  const path file = folder / name;
  std::error_code ec;
  std::filesystem::create_directories(file.parent_path(), ec);
  const path from = std::filesystem::canonical(folder, ec), to = std::filesystem::canonical(file.parent_path(), ec);
  if (ec) return failure(ErrorKind::io, "cannot make the folder of " + file.string() + ": " + ec.message());
  if (std::mismatch(from.begin(), from.end(), to.begin(), to.end()).first != from.end())
    return failure(ErrorKind::bad_data, file.string() + " leads out of " + folder.string() + " by a link; remove the link");
  return dataset::write_durably(file, bytes);
}

bool is_there(const path& file, const std::string& digest) {
  const auto there = dataset::digest_of_file(file);
  return there && *there == digest;
}

}  // namespace

std::string FarmJob::folder() const { return path(file).stem().string() + "-" + id.substr(0, 12); }

std::string FarmJob::to_json() const {
  json names = json::array();
  for (const FarmFile& f : files) names.push_back({{"name", f.name}, {"sha256", f.digest}});
  return json{{"version", version},
              {"instruction_set", instruction_set},
              {"file", file},
              {"files", names},
              {"shards", shards},
              {"shard_pings", shard_pings},
              {"pings", pings},
              {"patience_ms", patience.count()},
              {"submitted_unix_s", submitted_unix_s},
              {"in_bucket", in_bucket}}
      .dump();
}

Result<FarmJob> describe(const dataset::DatasetJob& job, const std::string& instruction_set) {
  FarmJob record;
  record.version = render::version, record.instruction_set = instruction_set;
  record.file = path(job.source).filename().string();
  record.shards = job.shards(), record.shard_pings = job.shard_pings, record.pings = job.pings;
  std::map<std::string, std::string> names{{record.file, sha256_of(job.text)}};
  const path folder = std::filesystem::absolute(job.folder / ".").lexically_normal();
  for (const dataset::NamedFile& named : dataset::named_files(job)) {
    const path name = std::filesystem::absolute(named.file).lexically_normal().lexically_relative(folder);
    if (!is_confined(name))
      return failure(ErrorKind::config, job.source + ": " + named.word + " is outside the job's folder " + folder.string() +
                                            "; a farm job uses only files in that folder: copy the file into it");
    names[name.string()] = named.digest;
  }
  for (const auto& [name, digest] : names) record.files.push_back({name, digest});
  record.id = id_of(record);
  return record;
}

/// Checks a record from the network: the id must be the digest of its contents, and its names must stay inside the folder.
Result<FarmJob> parse_farm_job(const std::string& id, const std::string& text) {
  FarmJob record;
  try {
    const json words = json::parse(text);
    record.version = words.at("version"), record.instruction_set = words.at("instruction_set"), record.file = words.at("file");
    for (const json& f : words.at("files")) record.files.push_back({f.at("name"), f.at("sha256")});
    if (const auto counts = read_counts(words, record); !counts)
      return failure(ErrorKind::bad_data,
                     "the farm's record of job " + id + " is invalid: " + counts.error().text + "; submit the job again");
    record.submitted_unix_s = words.at("submitted_unix_s"), record.in_bucket = words.at("in_bucket");
  } catch (const json::exception& e) {
    return failure(ErrorKind::bad_data, "the farm's record of job " + id + " cannot be read: " + e.what());
  }
  record.id = id_of(record);
  const bool is_named = std::any_of(record.files.begin(), record.files.end(), [&](const FarmFile& f) {
    return f.name == record.file && path(f.name).filename() == f.name;
  });
  const bool is_inside =
      std::all_of(record.files.begin(), record.files.end(), [](const FarmFile& f) { return is_confined(f.name); });
  if (record.id == id && is_named && is_inside) return record;
  return failure(ErrorKind::bad_data, "the farm's record of job " + id +
                                          (is_inside ? " does not match its id" : " has names that lead out of its folder") +
                                          "; submit the job again");
}

/// Copies the files into the shared folder and, if they are small in total, also into the queue, so that workers need no shared
/// folder.
Result<void> send_files(const dataset::DatasetJob& job, FarmJob& record, const path& files, Queue& queue) {
  std::uint64_t bytes = 0;
  std::error_code ec;
  for (const FarmFile& f : record.files)
    bytes += f.name == record.file ? job.text.size() : std::filesystem::file_size(job.folder / f.name, ec);
  record.in_bucket = bytes < most_in_bucket;
  for (const FarmFile& f : record.files) {
    const auto contents = f.name == record.file ? job.text : read_regular(job.folder / f.name, std::size_t{1} << 40);
    if (!contents) return tl::make_unexpected(contents.error());
    if (sha256_of(*contents) != f.digest)
      return failure(ErrorKind::bad_data,
                     (job.folder / f.name).string() + " has changed since the job was read; submit it again");
    if (!is_there(files / f.name, f.digest))
      if (const auto done = write_below(files, f.name, *contents); !done) return done;
    if (!record.in_bucket) continue;
    // A file without bytes is sent as one empty piece.
    for (std::size_t at = 0, piece = 0; at < contents->size() || piece == 0; at += piece_bytes, ++piece)
      if (const auto done =
              queue.put(file_table, piece_key(f.digest, piece), std::string_view(*contents).substr(at, piece_bytes));
          !done)
        return done;
  }
  return {};
}

/// Fetches the files that are missing or have a wrong digest. The digest is checked before a file is written.
Result<path> receive_files(const FarmJob& record, const path& files, Queue& queue) {
  for (const FarmFile& f : record.files) {
    if (is_there(files / f.name, f.digest)) continue;
    std::string contents;
    while (record.in_bucket) {
      const auto piece = queue.get(file_table, piece_key(f.digest, contents.size() / piece_bytes));
      if (!piece) return tl::make_unexpected(piece.error());
      if (!*piece) break;
      contents += **piece;
      // A short piece ends the file. If all pieces of a file are full, the file ends where the next piece is missing.
      if ((*piece)->size() < piece_bytes || contents.size() > most_in_bucket) break;
    }
    if (sha256_of(contents) != f.digest)
      return failure(ErrorKind::missing_file,
                     (files / f.name).string() + " is missing, or differs from the submitted file" +
                         (record.in_bucket ? ", and the queue does not have it; submit the job again"
                                           : "; the files of this job are 8 MiB or more in all, so the queue does not carry "
                                             "them: start the worker with the same --out folder as `sonarctl farm submit`"));
    if (const auto done = write_below(files, f.name, contents); !done) return tl::make_unexpected(done.error());
  }
  return files / record.file;
}

Result<dataset::DatasetJob> load_files(const FarmJob& record, const path& file) {
  auto job = dataset::load_job(file);
  if (!job) return job;
  if (job->shards() == record.shards && job->shard_pings == record.shard_pings && job->pings == record.pings) return job;
  return failure(ErrorKind::bad_data, "the farm's record of job " + record.id + " does not match its file " + record.file +
                                          ": the record has " + counts_text(record.shards, record.pings, record.shard_pings) +
                                          ", the file has " + counts_text(job->shards(), job->pings, job->shard_pings) +
                                          "; submit the job again");
}

std::string why_unfit(const FarmJob& record) {
  if (record.version != render::version)
    return record.folder() + " was submitted with sonard " + record.version + ", and this is sonard " + render::version +
           ", which may give other results: install sonard " + record.version + " here, or submit the job with sonard " +
           render::version;
  const auto level = enum_from<SimdLevel>(record.instruction_set, simd_level_names);
  const std::string here = level ? simd::kernels_for(*level).name : "unknown";
  if (here == record.instruction_set) return {};
  return record.folder() + " needs " + record.instruction_set + ", which this processor lacks: submit the job with --simd " +
         here + ", which this processor has, or run the worker on another machine";
}

}  // namespace sonar::farm
