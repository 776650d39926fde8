#include "daemon/commands/dataset/dataset_command.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "core/text/decimal.hpp"
#include "daemon/commands/dataset/make_dataset.hpp"
#include "daemon/commands/dataset/shards.hpp"

namespace sonar::dataset {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

/// "3/8": from 0 to below 8.
bool read_part(const std::string& text, DatasetOptions& o) {
  const std::size_t slash = text.find('/');
  if (text.empty()) return true;
  if (slash == std::string::npos) return false;
  const auto part = text::parse_unsigned(text.substr(0, slash)), parts = text::parse_unsigned(text.substr(slash + 1));
  if (!part || !parts || *part >= *parts) return false;
  o.part = *part, o.parts = *parts;
  return true;
}

}  // namespace

Result<int> run_dataset(const DatasetCommand& command) {
  DatasetOptions options;
  options.out = command.out;
  options.threads = command.threads.value_or(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  if (!read_part(command.shards, options))
    return failure(ErrorKind::usage, "--shards " + command.shards + " is not I/N with I from 0 to below N, as 3/8");
  const auto job = load_job(command.job);
  if (!job) return tl::make_unexpected(job.error());
  const auto begin = Clock::now();
  auto shown = begin;
  const auto done = make_dataset(*job, options, [&](const DatasetProgress& p) {
    const auto now = Clock::now();
    if (command.quiet || (now - shown < std::chrono::seconds(1) && p.pings < p.all_pings)) return;
    shown = now;
    const double rate = static_cast<double>(p.pings) / std::max(seconds_since(begin), 1e-3);
    std::fprintf(stderr, "%llu of %llu shards, %llu of %llu pings, %.1f pings/s, %.0f s left\n",
                 static_cast<unsigned long long>(p.shards), static_cast<unsigned long long>(p.all_shards),
                 static_cast<unsigned long long>(p.pings), static_cast<unsigned long long>(p.all_pings), rate,
                 static_cast<double>(p.all_pings - p.pings) / std::max(rate, 1e-9));
  });
  if (!done) return tl::make_unexpected(done.error());
  if (!command.quiet) {
    const std::uint64_t missing = done->missing.value_or(0);
    const std::string what = done->whole ? "the set is complete: manifest.json"
                                         : shard_name(missing) + " is missing, which --shards " +
                                               std::to_string(missing % options.parts) + "/" + std::to_string(options.parts) +
                                               " makes: no manifest yet";
    std::fprintf(stderr, "%llu pings in %.1f s; %llu shards were there already; %s\n",
                 static_cast<unsigned long long>(done->pings), seconds_since(begin),
                 static_cast<unsigned long long>(done->kept_shards), what.c_str());
  }
  return 0;
}

}  // namespace sonar::dataset
