#include "daemon/commands/options/commands.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include "core/text/decimal.hpp"
#include "daemon/commands/dataset/make_dataset.hpp"
#include "daemon/commands/dataset/shards.hpp"

namespace sonar::dataset {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

/// Reads a text such as "3/8". Returns false unless the first number is less than the second.
bool read_part(const std::string& text, DatasetOptions& o) {
  const std::size_t slash = text.find('/');
  if (text.empty()) return true;
  if (slash == std::string::npos) return false;
  const auto part = text::parse_unsigned(text.substr(0, slash)), parts = text::parse_unsigned(text.substr(slash + 1));
  if (!part || !parts || *part >= *parts) return false;
  o.part = *part, o.parts = *parts;
  return true;
}

std::atomic<bool> stopping{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// Stops the run; the second signal ends the program at once.
extern "C" void on_stop(int signal) {
  stopping = true;
  std::signal(signal, SIG_DFL);
}

int say_stopped(const DatasetProgress& p) {
  std::fprintf(stderr,
               "stopped: %llu of %llu pings are made and kept, in %llu finished shards%s; run the command again to continue\n",
               static_cast<unsigned long long>(p.pings), static_cast<unsigned long long>(p.all_pings),
               static_cast<unsigned long long>(p.shards), p.set_aside > 0 ? " and one begun" : "");
  constexpr int by_signal = 128 + SIGINT;  // the exit code that shells report
  return by_signal;
}

void say_exported(const Exported& e, const DatasetCommand& command) {
  std::fprintf(stderr, "%s: train %llu, val %llu, test %llu pings of %zu scenes%s\n", e.folder.c_str(),
               static_cast<unsigned long long>(e.pings[0]), static_cast<unsigned long long>(e.pings[1]),
               static_cast<unsigned long long>(e.pings[2]), e.scenes,
               e.divided_scenes > 0 ? (", " + std::to_string(e.divided_scenes) + " of them in several splits").c_str() : "");
  if (e.scenes < split_names.size() && command.split_by.empty())
    std::fprintf(stderr,
                 "there are too few different scenes for three splits; give --split-by a draw that differs between pings\n");
}

}  // namespace

Result<int> run_dataset(const DatasetCommand& command) {
  DatasetOptions options;
  options.out = command.out;
  options.threads = command.threads.value_or(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  if (!read_part(command.shards, options))
    return failure(ErrorKind::usage, "--shards " + command.shards + " is not I/N with I from 0 to N - 1, such as 3/8");
  const auto split = parse_split(command.split, command.split_by);
  if (!split) return tl::make_unexpected(split.error());
  const auto job = load_job(command.job);
  if (!job) return tl::make_unexpected(job.error());
  const ExportForm form = command.export_form == "coco" ? ExportForm::coco : ExportForm::folder;
  if (!command.export_form.empty())
    if (const auto able = check_export(*job, command.out, form, *split); !able) return tl::make_unexpected(able.error());
  options.stop = &stopping;
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, on_stop);
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
  if (done->stopped) return say_stopped(*done);
  if (!command.quiet) {
    const std::uint64_t missing = done->missing.value_or(0);
    const std::string what = done->whole ? "the set is complete: manifest.json"
                                         : "no manifest yet, because " + shard_name(missing) + " is missing (--shards " +
                                               std::to_string(missing % options.parts) + "/" + std::to_string(options.parts) +
                                               " makes it)";
    std::fprintf(stderr, "%llu pings in %.1f s; %llu shards were there already; %s\n",
                 static_cast<unsigned long long>(done->pings), seconds_since(begin),
                 static_cast<unsigned long long>(done->kept_shards), what.c_str());
  }
  if (command.export_form.empty()) return 0;
  if (!done->whole)
    return failure(ErrorKind::usage, "--export needs a complete set: " + shard_name(done->missing.value_or(0)) + " is missing");
  const auto exported = export_dataset(*job, command.out, form, *split);
  if (!exported) return tl::make_unexpected(exported.error());
  if (!command.quiet) say_exported(*exported, command);
  return 0;
}

}  // namespace sonar::dataset
