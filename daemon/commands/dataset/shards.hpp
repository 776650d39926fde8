// Writes the files of a data set: pings in tar archives that WebDataset reads, and the small files beside the archives. Each file
// gets its final name by a rename when it is complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/base/result.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::dataset {

/// Returns a name such as "shard-000123.tar".
std::string shard_name(std::uint64_t shard);

/// A file that gets its final name when it is complete. Until then its name is NAME.tmp.HOST.PID, which no other process uses, in
/// the same folder, and it is locked, so that remove_unfinished() can distinguish it from a file that a killed run left. The
/// destructor removes a file that was not committed.
class DurableFile {
 public:
  static Result<DurableFile> open(const std::filesystem::path& file);
  DurableFile(DurableFile&&) noexcept;
  DurableFile& operator=(DurableFile&&) = delete;
  ~DurableFile();

  /// Fails with ErrorKind::io, for example when the disk is full.
  Result<void> write(std::span<const std::byte> bytes);
  Result<void> write(std::string_view text) { return write(std::as_bytes(std::span(text))); }
  /// Calls fsync and rename; an existing file is replaced.
  Result<void> commit();
  /// Like commit(), but keeps an existing file and then returns false.
  Result<bool> commit_new();
  /// Like commit(), but with another name.
  Result<void> commit_as(std::filesystem::path file) { return file_ = std::move(file), commit(); }
  const std::filesystem::path& file() const { return file_; }

 private:
  DurableFile(std::filesystem::path file, std::filesystem::path unfinished, int descriptor)
      : file_(std::move(file)), unfinished_(std::move(unfinished)), descriptor_(descriptor) {}

  std::filesystem::path file_, unfinished_;
  int descriptor_ = -1;
};

/// Removes the unfinished files that killed runs left, if `is_own` accepts their final names.
void remove_unfinished(const std::filesystem::path& folder, const std::function<bool(const std::string&)>& is_own);

/// Writes a ustar archive. Owner, mode and times are fixed, so that equal contents are equal bytes.
class ShardWriter {
 public:
  static Result<ShardWriter> open(const std::filesystem::path& file);

  /// Adds a file; `name` has at most 99 bytes. Fails with ErrorKind::io, for example when the disk is full.
  Result<void> add(std::string_view name, std::span<const std::byte> contents);
  /// Continues an archive that was set aside. Returns false, with nothing written, if the archive is missing or has another
  /// digest.
  Result<bool> go_on(const std::filesystem::path& aside, const std::string& digest);
  /// Stores the incomplete archive under another name. Returns the digest.
  Result<std::string> set_aside(const std::filesystem::path& aside);
  /// Writes the end of the archive and gives it its final name, then writes `file`.sha256 in the format of sha256sum. Returns the
  /// digest. If another worker has committed an archive of that name, that archive is kept. If its bytes differ, the error
  /// is ErrorKind::bad_data.
  Result<std::string> commit();
  std::uint64_t bytes() const { return hash_.size(); }

 private:
  explicit ShardWriter(DurableFile file) : file_(std::move(file)) {}
  Result<void> write(std::span<const std::byte> bytes);

  DurableFile file_;
  Sha256 hash_;
};

/// Receives the name and the contents of a file of an archive.
using ArchiveSink = std::function<Result<void>(const std::string&, std::span<const std::byte>)>;
/// Reads the files of an archive that ShardWriter wrote, in order. Fails with ErrorKind::bad_data if the archive is damaged, and
/// with any error of the sink.
Result<void> read_archive(const std::filesystem::path& file, const ArchiveSink& take);

/// Writes a small file in one step.
Result<void> write_durably(const std::filesystem::path& file, std::string_view text);

/// Returns the digest of a whole file, in hexadecimal.
Result<std::string> digest_of_file(const std::filesystem::path& file);

// The notes beside each shard, shard-NNNNNN.json: facts of its pings for the manifest, the COCO file and the exports.

/// Returns the name of a ping in its shard, such as "0000000123".
std::string ping_key(std::uint64_t number);
std::filesystem::path part_file(const std::filesystem::path& set, std::uint64_t shard);

/// Reads the notes. `pixels`: samples by class; `images`: for each ping `id`, `width`, `height`, `negative`, `scene` (equal for
/// equal scenes), `draws` and `annotations`. Errors: bad_data if the file cannot be read.
Result<nlohmann::json> read_part(const std::filesystem::path& set, std::uint64_t shard);

nlohmann::json read_json(const std::filesystem::path& file);

}  // namespace sonar::dataset
