// The farm's queue: NATS JetStream behind plain functions. A stream FARM of shards to make (work queue, file store, subjects
// farm.work.JOB.SHARD), one durable pull consumer a job, and tables of keys and values. docs/decisions/0022-nats.md.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace sonar::farm {

struct QueueOptions {
  std::string url = "nats://127.0.0.1:4222";  // several: comma between
  std::filesystem::path credentials;          // a NATS credentials file; empty = none
  std::filesystem::path token_file;
  /// Called with the reason when no server answers: whether to try again. Empty: once.
  std::function<bool(const std::string& why)> try_again{};
};

/// Buckets of keys and values; `name` is the server's.
struct Table {
  const char* name;
  std::chrono::seconds lifetime;  // of a value
};
inline constexpr std::chrono::hours a_month{30 * 24};
inline constexpr Table job_table{"FARM_JOBS", a_month};                     // JOB: FarmJob; JOB.stopped: why
inline constexpr Table file_table{"FARM_FILES", a_month};                   // SHA256.N: a piece of a file
inline constexpr Table dead_table{"FARM_DEAD", a_month};                    // JOB.SHARD: why
inline constexpr Table beat_table{"FARM_BEATS", std::chrono::seconds(30)};  // HOST.PID: what the worker is at

/// A shard that this worker has for a while.
class Task {
 public:
  virtual ~Task() = default;
  virtual std::uint64_t shard() const = 0;
  virtual int delivery() const = 0;  // from 1
  virtual Result<void> in_progress() = 0;
  /// Waits for the server's word. Only then the shard is out of the queue.
  virtual Result<void> done() = 0;
  /// Another worker shall have it.
  virtual Result<void> again(std::chrono::milliseconds later) = 0;
  /// No worker shall have it.
  virtual Result<void> bury(const std::string& why) = 0;
  /// It is no shard: it leaves the queue without a trace.
  virtual Result<void> drop() = 0;
};

struct Waiting {
  std::uint64_t queued = 0, running = 0;
};

/// Calls block, for seconds at most. unavailable: the server does not answer, refuses, or has no JetStream. While the server is
/// away the connection is tried again without end.
class Queue {
 public:
  virtual ~Queue() = default;
  virtual Result<void> put(Table table, const std::string& key, std::string_view value) = 0;
  virtual Result<std::optional<std::string>> get(Table table, const std::string& key) = 0;
  virtual Result<std::vector<std::string>> keys(Table table) = 0;
  virtual Result<void> erase(Table table, const std::string& key) = 0;

  /// `patience`: a shard without a sign from its worker for so long is another worker's.
  virtual Result<void> open_job(const std::string& job, std::chrono::milliseconds patience) = 0;
  /// False: it is in the queue already.
  virtual Result<bool> publish(const std::string& job, std::uint64_t shard) = 0;
  virtual Result<Waiting> waiting(const std::string& job) = 0;
  /// The next task; empty if none came within `wait`. The task must not outlive the queue.
  virtual Result<std::unique_ptr<Task>> take(const std::string& job, std::chrono::milliseconds wait) = 0;
};

/// Connects and makes what the farm has on the server, where it is missing. unavailable also: sonard was built without libnats.
Result<std::unique_ptr<Queue>> connect(const QueueOptions& options);

}  // namespace sonar::farm
