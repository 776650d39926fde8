// The farm's queue: plain functions that use NATS JetStream. The stream FARM (work queue, file store, subjects
// farm.work.JOB.SHARD) has the shards that are not made yet. Each job has one durable pull consumer. Tables hold keys and values
// (docs/decisions/0022-nats.md).
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/options/queue_options.hpp"

namespace sonar::farm {

/// A bucket of keys and values; `name` is its name on the server.
struct Table {
  const char* name;
  std::chrono::seconds lifetime;  // lifetime of a value
};
inline constexpr std::chrono::hours a_month{30 * 24};
inline constexpr Table job_table{"FARM_JOBS", a_month};    // key JOB: a FarmJob; key JOB.stopped: why the job was stopped
inline constexpr Table file_table{"FARM_FILES", a_month};  // key SHA256.N: a piece of a file
inline constexpr Table dead_table{"FARM_DEAD", a_month};   // key JOB.SHARD: why the shard failed
inline constexpr Table beat_table{"FARM_BEATS", std::chrono::seconds(30)};  // key HOST.PID: what that worker does

/// A shard that this worker makes. Within the `patience` of the job the worker must call in_progress(), or one of the functions
/// that end the task.
class Task {
 public:
  virtual ~Task() = default;
  virtual std::uint64_t shard() const = 0;
  virtual int delivery() const = 0;  // number of this delivery, from 1
  virtual Result<void> in_progress() = 0;
  /// Waits until the server confirms that the shard has left the queue.
  virtual Result<void> done() = 0;
  /// Returns the shard to the queue, which delivers it again after `later`.
  virtual Result<void> again(std::chrono::milliseconds later) = 0;
  /// Removes the shard from the queue for good, and writes `why` into dead_table.
  virtual Result<void> bury(const std::string& why) = 0;
  /// Removes a message that names no shard of the job, without a record.
  virtual Result<void> drop() = 0;
};

struct Waiting {
  std::uint64_t queued = 0, running = 0;
};

/// The functions block, for seconds at most. They fail with ErrorKind::unavailable if the server does not answer, refuses, or has
/// no JetStream. While the server cannot be reached, the client library reconnects in the background, without a limit.
class Queue {
 public:
  virtual ~Queue() = default;
  virtual Result<void> put(Table table, const std::string& key, std::string_view value) = 0;
  virtual Result<std::optional<std::string>> get(Table table, const std::string& key) = 0;
  virtual Result<std::vector<std::string>> keys(Table table) = 0;
  virtual Result<void> erase(Table table, const std::string& key) = 0;

  /// Creates the consumer of a job. If a worker sends no report about its shard for `patience`, another worker gets the shard.
  virtual Result<void> open_job(const std::string& job, std::chrono::milliseconds patience) = 0;
  /// Adds a shard to the queue. Returns false if the queue has the shard already.
  virtual Result<bool> publish(const std::string& job, std::uint64_t shard) = 0;
  virtual Result<Waiting> waiting(const std::string& job) = 0;
  /// Returns the next task; null if none came within `wait`. The task must not outlive the queue.
  virtual Result<std::unique_ptr<Task>> take(const std::string& job, std::chrono::milliseconds wait) = 0;
};

/// Connects, and creates the stream and the tables on the server if they are missing. Also fails with ErrorKind::unavailable when
/// sonard was built without libnats.
Result<std::unique_ptr<Queue>> connect(const QueueOptions& options);

}  // namespace sonar::farm
