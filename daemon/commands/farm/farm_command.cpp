#include "daemon/commands/options/commands.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/base/enum_names.hpp"
#include "core/base/regular_file.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/dataset/make_dataset.hpp"
#include "daemon/commands/dataset/shards.hpp"
#include "daemon/commands/farm/farm_job.hpp"
#include "daemon/commands/farm/queue.hpp"

namespace sonar::farm {
namespace {

using dataset::shard_name;
using nlohmann::json;
using std::filesystem::path;

using Ull = unsigned long long;

Result<std::unique_ptr<dataset::DatasetFolder>> open_folder(const dataset::DatasetJob& job, const path& out,
                                                            const std::string& instruction_set) {
  dataset::DatasetOptions options;
  options.out = out;
  options.simd = enum_from<SimdLevel>(instruction_set, simd_level_names);
  return dataset::open_dataset(job, options, [](const dataset::DatasetProgress&) {});
}

/// Sends the files and the record, opens the consumer, publishes the missing shards, and last removes the mark "stopped". With
/// this order a submission can safely be repeated.
Result<int> submit(const FarmCommand& c) {
  auto job = dataset::load_job(c.job);
  if (!job) return tl::make_unexpected(job.error());
  auto level = enum_from<SimdLevel>(c.simd, simd_level_names).value_or(SimdLevel::automatic);
  // All shards of a job are computed with one instruction set, because other sets round differently. It is chosen now, and is
  // part of the record.
  if (level == SimdLevel::automatic) {
    const auto first = draw_ping(*job, 1);
    if (!first) return tl::make_unexpected(first.error());
    level = first->job.config.engine.simd;
  }
  const std::string set = simd::kernels_for(level).name;
  if (level != SimdLevel::automatic && set != simd_level_names[static_cast<std::size_t>(level)])
    return failure(ErrorKind::unavailable, "this processor lacks " +
                                               std::string(simd_level_names[static_cast<std::size_t>(level)]) +
                                               ": submit on a computer with the workers' instruction set, or with --simd " + set);
  auto record = describe(*job, set);
  if (!record) return tl::make_unexpected(record.error());
  const auto queue = connect(c.queue);
  if (!queue) return tl::make_unexpected(queue.error());
  const path out = path(c.out) / record->folder();
  const auto folder = open_folder(*job, out, record->instruction_set);
  if (!folder) return tl::make_unexpected(folder.error());
  record->patience = std::chrono::milliseconds(static_cast<std::int64_t>(c.ack_wait_s * 1000));
  record->submitted_unix_s = static_cast<double>(std::time(nullptr));
  if (const auto done = send_files(*job, *record, out / "files", **queue); !done) return tl::make_unexpected(done.error());
  if (const auto done = (*queue)->put(job_table, record->id, record->to_json()); !done) return tl::make_unexpected(done.error());
  if (const auto done = (*queue)->open_job(record->id, record->patience); !done) return tl::make_unexpected(done.error());
  const auto dead = (*queue)->keys(dead_table);
  if (!dead) return tl::make_unexpected(dead.error());
  std::uint64_t there = 0, published = 0, waiting = 0;
  for (std::uint64_t shard = 0; shard < record->shards; ++shard) {
    const auto is_there = (*folder)->holds(shard);
    if (!is_there) return tl::make_unexpected(is_there.error());
    // A shard that was given up earlier is tried again, because the cause of its failure may have been removed.
    const std::string grave = record->id + "." + std::to_string(shard);
    if (std::find(dead->begin(), dead->end(), grave) != dead->end())
      if (const auto done = (*queue)->erase(dead_table, grave); !done) return tl::make_unexpected(done.error());
    if (*is_there) {
      ++there;
      continue;
    }
    const auto is_new = (*queue)->publish(record->id, shard);
    if (!is_new) return tl::make_unexpected(is_new.error());
    ++(*is_new ? published : waiting);
  }
  if (const auto done = (*queue)->erase(job_table, record->id + ".stopped"); !done) return tl::make_unexpected(done.error());
  std::printf(
      "%s (%s): %llu shards: %llu submitted, %llu in the queue already, %llu finished\nwhen all are finished: sonarctl farm "
      "collect %s\n",
      record->folder().c_str(), set.c_str(), static_cast<Ull>(record->shards), static_cast<Ull>(published),
      static_cast<Ull>(waiting), static_cast<Ull>(there), out.c_str());
  return 0;
}

/// Returns the values of a table, by key, without those that were removed in the meantime.
Result<std::map<std::string, std::string>> read_table(Queue& queue, Table table) {
  const auto keys = queue.keys(table);
  if (!keys) return tl::make_unexpected(keys.error());
  std::map<std::string, std::string> all;
  for (const std::string& key : *keys) {
    auto value = queue.get(table, key);
    if (!value) return tl::make_unexpected(value.error());
    if (*value) all[key] = **std::move(value);
  }
  return all;
}

/// Returns a text of a JSON object that another program wrote, so a value of another type counts as missing.
std::string text_in(const json& is, const char* key) {
  const auto at = is.find(key);
  return at != is.end() && at->is_string() ? at->get<std::string>() : std::string();
}
double number_in(const json& is, const char* key) {
  const auto at = is.find(key);
  return at != is.end() && at->is_number() ? std::clamp(at->get<double>(), 0.0, 1e15) : 0.0;
}

}  // namespace

Result<std::string> describe_farm(Queue& queue) {
  const auto records = read_table(queue, job_table), dead = read_table(queue, dead_table),
             at_work = read_table(queue, beat_table);
  for (const auto* table : {&records, &dead, &at_work})
    if (!*table) return tl::make_unexpected(table->error());
  std::string text;
  for (const auto& [id, words] : *records) {
    // The key ID.stopped marks a stopped job; it is not a job.
    if (id.find('.') != std::string::npos) continue;
    const auto record = parse_farm_job(id, words);
    const auto waiting = queue.waiting(id);
    if (!waiting) return tl::make_unexpected(waiting.error());
    if (!record) {
      text += text::printable(record.error().text) + "\n";
      continue;
    }
    std::string dead_lines, workers;
    std::uint64_t dead_shards = 0;
    for (auto at = dead->lower_bound(id + "."); at != dead->end() && at->first.starts_with(id + "."); ++at) {
      const auto shard = text::parse_unsigned(at->first.substr(id.size() + 1));
      if (!shard || *shard >= record->shards) continue;  // not a shard of the job
      ++dead_shards;
      dead_lines += "  dead: shard " + std::to_string(*shard) + ": " + text::printable(at->second) + "\n";
    }
    double pings_per_s = 0;
    std::uint64_t running = 0;
    for (const auto& [name, beat] : *at_work) {
      const json is = json::parse(beat, nullptr, false);
      if (!is.is_object() || text_in(is, "job") != id) continue;
      const double rate = number_in(is, "pings_per_s");
      pings_per_s += rate;
      running += running < waiting->running ? 1 : 0;  // the other shards wait for another try
      workers += text::format("  %s: %s, %.1f pings/s, %.0f shards made\n", text::printable(name).c_str(),
                              text::printable(text_in(is, "shard")).c_str(), rate, number_in(is, "shards"));
    }
    // A shard is done if it does not wait, does not run and was not given up.
    const std::uint64_t left = waiting->queued + waiting->running;
    const std::uint64_t done = record->shards - std::min(record->shards, left + dead_shards);
    text += text::format("%s (%s): %llu shards: %llu done, %llu running, %llu queued, %llu dead",
                         text::printable(record->folder()).c_str(), text::printable(record->instruction_set).c_str(),
                         static_cast<Ull>(record->shards), static_cast<Ull>(done), static_cast<Ull>(running),
                         static_cast<Ull>(left - running), static_cast<Ull>(dead_shards));
    if (left > 0 && pings_per_s > 0)
      text += text::format("; %.1f pings/s, about %.0f s left", pings_per_s,
                           static_cast<double>(std::min(left * record->shard_pings, record->pings)) / pings_per_s);
    text += "\n";
    if (const auto why = records->find(id + ".stopped"); why != records->end())
      text += "  STOPPED: " + text::printable(why->second) + "\n";
    text += dead_lines + workers;
  }
  return text.empty() ? "the farm has no jobs\n" : text;
}

namespace {

Result<int> status(const FarmCommand& c) {
  const auto queue = connect(c.queue);
  if (!queue) return tl::make_unexpected(queue.error());
  while (true) {
    const auto text = describe_farm(**queue);
    // With --watch the program shows an error and continues, because the server may come back.
    if (!text && !c.watch) return tl::make_unexpected(text.error());
    // The escape sequence clears the terminal, so each status replaces the last.
    std::printf("%s%s", c.watch ? "\033[H\033[J" : "", (text ? *text : text.error().text + "\n").c_str());
    std::fflush(stdout);
    if (!c.watch) return 0;
    std::this_thread::sleep_for(std::chrono::seconds(2));
  }
}

/// Returns the job file and the instruction set that job.json in the folder of a job names.
Result<FarmJob> described_in(const path& folder) {
  const auto words = read_regular(folder / "job.json", std::size_t{16} << 20);
  if (!words) return failure(words.error().kind, words.error().text + "; give the folder of a job, which submit printed");
  const json is = json::parse(*words, nullptr, false);
  FarmJob record;
  if (!is.is_object())
    return failure(ErrorKind::bad_data, (folder / "job.json").string() + " cannot be read; submit the job again");
  record.file = path(text_in(is, "from")).filename().string(), record.instruction_set = text_in(is, "instruction_set");
  return record;
}

/// Compares every shard with its digest, and completes the set. Uses only the folder, not the queue.
Result<int> collect(const FarmCommand& c) {
  const path out = c.out;
  const auto record = described_in(out);
  if (!record) return tl::make_unexpected(record.error());
  const auto job = dataset::load_job(out / "files" / record->file);
  if (!job) return tl::make_unexpected(job.error());
  const auto folder = open_folder(*job, out, record->instruction_set);
  if (!folder) return tl::make_unexpected(folder.error());
  std::string holes;
  std::uint64_t missing = 0;
  for (std::uint64_t shard = 0; shard < job->shards(); ++shard) {
    const auto is_there = (*folder)->holds(shard);
    if (!is_there) return tl::make_unexpected(is_there.error());
    constexpr std::uint64_t most_named = 20;
    if (!*is_there && ++missing <= most_named) holes += (holes.empty() ? "" : ", ") + shard_name(shard);
  }
  if (missing > 0)
    return failure(ErrorKind::bad_data, out.string() + ": " + std::to_string(missing) + " of " + std::to_string(job->shards()) +
                                            " shards are missing: " + holes + "; wait for them, or submit the job again");
  const auto done = (*folder)->conclude();
  if (!done) return tl::make_unexpected(done.error());
  std::printf("%s: %llu shards as they were written; the set is complete: manifest.json\n", out.c_str(),
              static_cast<Ull>(job->shards()));
  return 0;
}

}  // namespace

Result<int> run_farm(const FarmCommand& command) {
  if (command.what == FarmCommand::What::submit) return submit(command);
  if (command.what == FarmCommand::What::status) return status(command);
  return collect(command);
}

}  // namespace sonar::farm
