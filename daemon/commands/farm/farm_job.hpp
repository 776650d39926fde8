// A data set's job for workers: a record, and the bytes of the job file and of all files that it names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/dataset/dataset_job.hpp"
#include "daemon/commands/farm/queue.hpp"

namespace sonar::farm {

struct FarmFile {
  std::string name;  // path below the folder of the job file
  std::string digest;
};

struct FarmJob {
  std::string id;  // SHA-256 of the canonical JSON of the next four members, on which the bytes of the shards depend
  std::string version, instruction_set;
  std::string file;             // the job file, one of `files`
  std::vector<FarmFile> files;  // in the order of their names
  std::uint64_t shards = 0, shard_pings = 0, pings = 0;
  std::chrono::milliseconds patience{60'000};
  double submitted_unix_s = 0;
  bool in_bucket = false;  // true: the files are in the queue; false: only in the shared folder

  /// Returns the name of the job's folder in the farm's folder, such as "mines-0123456789ab".
  std::string folder() const;
  std::string to_json() const;
};

/// Makes the record of a job. Errors: a file is not below the folder of the job file.
Result<FarmJob> describe(const dataset::DatasetJob& job, const std::string& instruction_set);
/// Reads a record. Error bad_data: the text is not a record, or has another id, impossible counts, or names that lead out of the
/// job's folder.
Result<FarmJob> parse_farm_job(const std::string& id, const std::string& json);

/// Copies the job's files to `files`, and into the queue if they are small enough (`in_bucket`).
Result<void> send_files(const dataset::DatasetJob& job, FarmJob& record, const std::filesystem::path& files, Queue& queue);
/// Fetches the files that the folder `files` lacks from the queue. Returns the path of the job file. Error missing_file: a file
/// is in neither.
Result<std::filesystem::path> receive_files(const FarmJob& record, const std::filesystem::path& files, Queue& queue);

/// Reads the job file of receive_files(). Errors: bad_data if its numbers of pings and shards differ from the record.
Result<dataset::DatasetJob> load_files(const FarmJob& record, const std::filesystem::path& file);

/// Returns a sentence if this program would make other bytes than the program that submitted the job; else empty.
std::string why_unfit(const FarmJob& record);

}  // namespace sonar::farm
