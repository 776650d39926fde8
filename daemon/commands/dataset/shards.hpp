// Files of a data set: pings in tar archives that WebDataset reads, each committed by its rename, and what is written beside
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::dataset {

/// "shard-000123.tar".
std::string shard_name(std::uint64_t shard);

/// A file that has its name when it is complete. Until then it is beside it as NAME.tmp.HOST.PID, which no other process opens,
/// and locked, so that remove_unfinished() can tell what a killed run left. What is not committed is removed.
class DurableFile {
 public:
  static Result<DurableFile> open(const std::filesystem::path& file);
  DurableFile(DurableFile&&) noexcept;
  DurableFile& operator=(DurableFile&&) = delete;
  ~DurableFile();

  /// io: a full disk.
  Result<void> write(std::span<const std::byte> bytes);
  Result<void> write(std::string_view text) { return write(std::as_bytes(std::span(text))); }
  /// fsync and rename; a file of that name is replaced.
  Result<void> commit();
  /// The same, but a file of that name stays as it is: then false.
  Result<bool> commit_new();
  /// The same under another name.
  Result<void> commit_as(std::filesystem::path file) { return file_ = std::move(file), commit(); }
  const std::filesystem::path& file() const { return file_; }

 private:
  DurableFile(std::filesystem::path file, std::filesystem::path unfinished, int descriptor)
      : file_(std::move(file)), unfinished_(std::move(unfinished)), descriptor_(descriptor) {}

  std::filesystem::path file_, unfinished_;
  int descriptor_ = -1;
};

/// Removes what killed runs left of files whose names `is_own` accepts.
void remove_unfinished(const std::filesystem::path& folder, const std::function<bool(const std::string&)>& is_own);

/// Writes a ustar archive. Owner, mode and times are fixed, so that equal contents are equal bytes.
class ShardWriter {
 public:
  static Result<ShardWriter> open(const std::filesystem::path& file);

  /// `name` of at most 99 bytes. io: a full disk.
  Result<void> add(std::string_view name, std::span<const std::byte> contents);
  /// Goes on with an archive that was set aside: its bytes, which have that digest. False, with nothing written, where they have
  /// another, or are not there.
  Result<bool> go_on(const std::filesystem::path& aside, const std::string& digest);
  /// Keeps what has been added under another name. Returns the digest.
  Result<std::string> set_aside(const std::filesystem::path& aside);
  /// The archive's end and name, then `file`.sha256 as sha256sum reads it. Returns the digest. An archive of that name that has
  /// come meanwhile stays; bad_data: its bytes differ.
  Result<std::string> commit();
  std::uint64_t bytes() const { return hash_.size(); }

 private:
  explicit ShardWriter(DurableFile file) : file_(std::move(file)) {}
  Result<void> write(std::span<const std::byte> bytes);

  DurableFile file_;
  Sha256 hash_;
};

/// Takes the name and the contents of a file of an archive.
using ArchiveSink = std::function<Result<void>(const std::string&, std::span<const std::byte>)>;
/// The files of an archive that ShardWriter wrote, in order. bad_data: it is damaged; what the sink returns.
Result<void> read_archive(const std::filesystem::path& file, const ArchiveSink& take);

/// A small file in one step.
Result<void> write_durably(const std::filesystem::path& file, std::string_view text);

/// Digest of a whole file, in hexadecimal.
Result<std::string> digest_of_file(const std::filesystem::path& file);

}  // namespace sonar::dataset
