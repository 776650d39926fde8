#include "daemon/commands/options/commands.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <future>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/base/enum_names.hpp"
#include "core/base/regular_file.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/dataset/make_dataset.hpp"
#include "daemon/commands/dataset/shards.hpp"
#include "daemon/commands/farm/farm_job.hpp"
#include "daemon/commands/farm/queue.hpp"

namespace sonar::farm {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::filesystem::path;

constexpr int most_tries = 4;
constexpr milliseconds most_between_beats = 5s, for_a_shard = 2s, least_rest = 500ms, most_rest = 5s;

volatile std::sig_atomic_t stopping = 0;

/// Prints to the console without control characters, because texts of the queue come from other programs.
void say_to(const WorkerCommand& command, const std::string& words) {
  if (!command.quiet) std::fprintf(stderr, "%s\n", text::printable(words).c_str());
}
void pause_for(milliseconds time) {
  for (const auto end = Clock::now() + time; Clock::now() < end && !stopping;) std::this_thread::sleep_for(50ms);
}

class Worker {
 public:
  Worker(const WorkerCommand& command, Queue& queue) : c_(command), queue_(queue) {
    std::array<char, 256> host{};
    ::gethostname(host.data(), host.size() - 1);
    name_ = std::string(host.data()) + "." + std::to_string(::getpid());
    for (char& c : name_)
      if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '.') c = '_';  // keys of the queue allow no others
  }

  // Takes jobs until a signal comes or, with until_empty, no job has work. An error of the server is temporary; other errors
  // end the worker.
  Result<int> run() {
    while (!stopping) {
      const auto job = next_job();
      if (!job && job.error().kind == ErrorKind::unavailable && !is_unfit_) {
        say(job.error().text + "; trying again");
        rest();
        continue;
      }
      if (!job) return tl::make_unexpected(job.error());
      if (!*job && c_.until_empty) break;
      if (!*job)
        rest();
      else if (const auto served = serve(**job); !served)
        return tl::make_unexpected(served.error());
    }
    queue_.erase(beat_table, name_);
    return 0;
  }

 private:
  void say(const std::string& words) const { say_to(c_, words); }

  /// Pauses. The pause gets longer until a shard is made, so that a thousand idle workers do not overload the server.
  void rest() {
    pause_for(rest_);
    rest_ = std::min(2 * rest_, most_rest);
  }

  /// Returns the first submitted job that has work; empty if no job has work.
  Result<std::optional<FarmJob>> next_job() {
    const auto ids = queue_.keys(job_table);
    if (!ids) return tl::make_unexpected(ids.error());
    std::optional<FarmJob> first;
    std::string unfit;
    for (const std::string& id : *ids) {
      // Keys with a dot are marks of jobs, such as JOB.stopped.
      if (id.find('.') != std::string::npos || std::find(ids->begin(), ids->end(), id + ".stopped") != ids->end()) continue;
      const auto waiting = queue_.waiting(id);
      if (!waiting) return tl::make_unexpected(waiting.error());
      if (waiting->queued + waiting->running == 0) continue;
      const auto words = queue_.get(job_table, id);
      if (!words) return tl::make_unexpected(words.error());
      if (!*words) continue;
      auto job = parse_farm_job(id, **words);
      const std::string why = unfit_.contains(id) ? unfit_[id] : job ? why_unfit(*job) : job.error().text;
      if (!why.empty())
        unfit = why;
      else if (!first || job->submitted_unix_s < first->submitted_unix_s)
        first = *std::move(job);
    }
    is_unfit_ = !first && !unfit.empty();
    if (is_unfit_) return failure(ErrorKind::unavailable, unfit);
    return first;
  }

  /// Works on the job until the queue has no waiting shard of it.
  Result<void> serve(const FarmJob& record) {
    if (opened_ != record.id)
      if (const auto opened = open(record); !opened) {
        if (opened.error().kind == ErrorKind::io) return opened;
        say(opened.error().text);
        if (opened.error().kind == ErrorKind::unavailable)
          rest();
        else
          unfit_[record.id] = opened.error().text;  // other workers make its shards
        return {};
      }
    while (!stopping) {
      const auto stopped = queue_.get(job_table, record.id + ".stopped");
      if (stopped && *stopped) return {};
      auto task = queue_.take(record.id, for_a_shard);
      if (!task) {  // the server does not answer, or the job no longer exists
        say(task.error().text);
        rest();
      }
      if (!task || !*task) return {};
      if ((*task)->shard() >= record.shards) {
        drop(record, **task);
        continue;
      }
      if (const auto done = work(record, **task); !done) return done;
    }
    return {};
  }

  /// Receives the files of the job and opens its folder. The last job stays open, because the next shard usually belongs to it
  /// too.
  Result<void> open(const FarmJob& record) {
    const path out = path(c_.out) / record.folder();
    const auto file = receive_files(record, out / "files", queue_);
    if (!file) return tl::make_unexpected(file.error());
    auto job = load_files(record, *file);
    if (!job) return tl::make_unexpected(job.error());
    folder_.reset();
    opened_.clear();
    job_ = *std::move(job);
    dataset::DatasetOptions options;
    options.out = out, options.threads = c_.threads.value_or(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
    options.simd = enum_from<SimdLevel>(record.instruction_set, simd_level_names);
    auto folder = dataset::open_dataset(job_, options, [this](const dataset::DatasetProgress& p) { pings_ = p.pings; });
    if (!folder) return tl::make_unexpected(folder.error());
    folder_ = *std::move(folder), opened_ = record.id, begin_ = Clock::now(), shards_ = 0, pings_ = 0;
    return {};
  }

  /// Removes a shard with an invalid number, because any program that reaches the queue can put one in.
  void drop(const FarmJob& record, Task& task) {
    say("shard " + std::to_string(task.shard()) + " is not one of the " + std::to_string(record.shards) + " of " +
        record.folder() + "; it is removed from the queue");
    if (const auto dropped = task.drop(); !dropped) {
      say(dropped.error().text);
      rest();
    }
  }

  // A shard that failed goes back to the queue for another try; after the last try it is recorded as dead.
  Result<void> refuse(const FarmJob& record, Task& task, const Error& why) {
    const bool is_last = task.delivery() >= most_tries;
    say(dataset::shard_name(task.shard()) + ": " + why.text + (is_last ? "; it is dead" : ""));
    const auto sent = is_last ? task.bury(why.text) : task.again(record.patience / 12);
    if (!sent) say(sent.error().text);
    rest();  // if every shard fails here, for example because a file is missing, other workers get the next tries
    return {};
  }

  /// Makes a shard. An error means that this worker cannot do any work.
  Result<void> work(const FarmJob& record, Task& task) {
    // The last refusal removes a shard from the queue. If it is delivered again, its workers ended without a refusal, so the
    // shard would probably end this worker too.
    if (task.delivery() > most_tries)
      return refuse(
          record, task,
          {ErrorKind::bug, "its workers ended " + std::to_string(most_tries) +
                               " times without an error: killed or out of memory; see their logs, submit the job again"});
    // The shard is made on another thread, so that this one can report progress to the queue.
    auto made = std::async(std::launch::async, [this, shard = task.shard()]() -> Result<bool> {
      const auto is_there = folder_->holds(shard);
      if (!is_there || *is_there) return is_there;
      const auto done = folder_->make(shard);
      if (!done) return tl::make_unexpected(done.error());
      return false;
    });
    // After `patience` without a report the queue gives the shard to another worker. One report may be lost.
    const milliseconds between_signs = record.patience / 3;
    const milliseconds tick = std::min(between_signs, most_between_beats);
    auto signed_at = Clock::now();
    while (made.wait_for(milliseconds(0)) != std::future_status::ready) {
      beat(record, dataset::shard_name(task.shard()));
      for (const auto until = Clock::now() + tick; Clock::now() < until && !stopping;)
        if (made.wait_for(std::min(tick, milliseconds(200))) == std::future_status::ready) break;
      if (stopping) leave(task);
      if (Clock::now() - signed_at < between_signs) continue;
      signed_at = Clock::now();
      if (const auto sign = task.in_progress(); !sign) say(sign.error().text);
    }
    const auto is_there = made.get();
    if (is_there) {
      shards_ += 1;
      rest_ = least_rest;
      acknowledge(task);
      say(dataset::shard_name(task.shard()) + (*is_there ? " was there already" : " of " + record.folder() + " is made"));
      return {};
    }
    const Error& why = is_there.error();
    // Two workers made different bytes of one shard. More shards of this job must not be trusted, so the job stops everywhere.
    if (folder_->differs()) {
      say("ALARM: " + why.text + "; the job is stopped");
      if (const auto put = queue_.put(job_table, record.id + ".stopped", why.text); !put) say(put.error().text);
      task.again({});
      return {};
    }
    if (why.kind != ErrorKind::io) return refuse(record, task, why);
    task.again({});  // this computer's disk is full, but another computer may have room
    return tl::make_unexpected(why);
  }

  /// Acknowledges a shard, whose file already has its final name. If the message is lost, the next worker finds the file.
  void acknowledge(Task& task) {
    constexpr int most = 60;
    for (int i = 0; i < most && !stopping; ++i) {
      const auto done = task.done();
      if (done) return;
      say(done.error().text + "; trying again");
      rest();
    }
  }

  /// Ends the program. Does not wait for the computing threads, because the files that they write have no final name yet.
  [[noreturn]] void leave(Task& task) {
    task.again({});
    queue_.erase(beat_table, name_);
    say("the unfinished shard was returned to the queue");
    std::_Exit(0);
  }

  // Reports to `sonarctl farm status` what this worker does. The entry expires by itself if the worker is killed.
  void beat(const FarmJob& record, const std::string& shard) {
    const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
    queue_.put(beat_table, name_,
               nlohmann::json{{"job", record.id},
                              {"shard", shard},
                              {"shards", shards_},
                              {"pings_per_s", static_cast<double>(pings_) / std::max(seconds, 1e-3)}}
                   .dump());
  }

  const WorkerCommand& c_;
  Queue& queue_;
  std::string name_;
  milliseconds rest_ = least_rest;
  std::map<std::string, std::string> unfit_;  // jobs that cannot be opened here, and why
  bool is_unfit_ = false;                     // true if the last error of next_job() was not an error of the server
  std::string opened_;                        // id of the open job, to which the members below belong
  dataset::DatasetJob job_;
  std::unique_ptr<dataset::DatasetFolder> folder_;
  Clock::time_point begin_;
  std::uint64_t shards_ = 0;
  std::atomic<std::uint64_t> pings_{0};
};

}  // namespace

Result<int> run_worker(const WorkerCommand& command) {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopping = 1; });
  std::signal(SIGPIPE, SIG_IGN);
  milliseconds rest = least_rest;
  QueueOptions options = command.queue;
  options.try_again = [&](const std::string& why) {
    say_to(command, why + "; trying again");
    pause_for(std::exchange(rest, std::min(2 * rest, most_rest)));
    return !stopping;
  };
  const auto queue = connect(options);
  if (stopping) return 0;
  if (!queue) return tl::make_unexpected(queue.error());
  return work_on(**queue, command);
}

Result<int> work_on(Queue& queue, const WorkerCommand& command) {
  std::error_code ec;
  std::filesystem::create_directories(command.out, ec);
  if (ec) return failure(ErrorKind::io, "cannot make the folder " + command.out + ": " + ec.message() + "; choose another --out");
  confine_reads(command.out);
  return Worker(command, queue).run();
}

}  // namespace sonar::farm
