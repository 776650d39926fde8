// Byte sources and sinks of recordings: read at an offset, append at the end. All formats use only these, so that recordings
// can be in memory or in files. In protocol/, only byte_source.cpp opens files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::recording {

// Functions of zlib for recordings and packets: decompression (.oculus files), CRC-32 (MCAP, packets of a sonar).

/// Returns the decompressed stream; nullopt if it is damaged or has more than `limit` bytes.
std::optional<wire::Bytes> inflate(wire::BytesView stream, std::size_t limit);

/// Returns the CRC-32 of the bytes. `crc`: the CRC of preceding bytes, to continue it.
std::uint32_t crc32(wire::BytesView bytes, std::uint32_t crc = 0);

using wire::Bytes;
using wire::BytesView;

class Source {
 public:
  virtual ~Source() = default;
  /// Returns the name for error texts.
  virtual const std::string& name() const = 0;
  virtual std::uint64_t size() const = 0;
  /// Fills `into` from `offset` on. Returns the number of bytes; it is smaller only if the source ends or cannot be read.
  virtual std::size_t read_at(std::uint64_t offset, std::span<std::byte> into) = 0;
};
/// Opens a file. Errors: missing_file, io; bad_data for a folder or a pipe.
Result<std::unique_ptr<Source>> open_source(const std::filesystem::path& file);
std::unique_ptr<Source> source_from(std::string name, Bytes bytes);

class Sink {
 public:
  virtual ~Sink() = default;
  /// Appends all bytes or none: a partial write on a full disk is undone, so that the file ends with a whole record. After an
  /// error (io), later calls fail too.
  virtual Result<void> append(BytesView record) = 0;
  /// Replaces bytes that were appended before. Errors: io.
  virtual Result<void> overwrite(std::uint64_t offset, BytesView bytes) = 0;
  /// After a failure, lets the next call try again with a smaller record.
  virtual void try_again() {}
  /// Closes the file, and reports late errors of the file system. Errors: io.
  virtual Result<void> close() = 0;
};
/// Creates the file, or empties an existing one. Errors: io.
Result<std::unique_ptr<Sink>> create_sink(const std::filesystem::path& file);
/// Creates a new file. Errors: io, also if the file exists, which is then not changed.
Result<std::unique_ptr<Sink>> create_new_sink(const std::filesystem::path& file);
/// Makes a sink that appends to `bytes`, which must outlive it.
std::unique_ptr<Sink> sink_into(Bytes& bytes);

/// Reads a source from start to end, through a buffer.
class Scan {
 public:
  explicit Scan(Source& source, std::uint64_t position = 0) : source_(source), position_(position) {}

  std::uint64_t position() const { return position_; }
  std::uint64_t left() const { return source_.size() > position_ ? source_.size() - position_ : 0; }
  /// Returns the next `count` bytes (fewer at the end), which are valid until the next call, and moves the position past them. It
  /// allocates no more than the size of the source, but the caller must limit `count`, because sources can be large.
  BytesView read(std::size_t count);
  /// Like read(), but the position does not move.
  BytesView peek(std::size_t count);
  void seek(std::uint64_t position) { position_ = position; }
  void skip(std::uint64_t count) { position_ += std::min(count, left()); }

 private:
  Source& source_;
  std::uint64_t position_ = 0, buffered_from_ = 0;
  Bytes buffer_;
};

}  // namespace sonar::recording
