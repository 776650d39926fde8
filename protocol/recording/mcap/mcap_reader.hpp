// Reads the messages of an MCAP file from start to end, chunk by chunk; it needs no summary, so a file truncated by a crash or
// a full disk is readable. It reads only uncompressed chunks, and skips chunks with a wrong CRC.
#pragma once

#include <map>
#include <memory>

#include "protocol/recorded/recorded_message.hpp"
#include "protocol/recording/mcap/mcap_records.hpp"

namespace sonar::recording::mcap {

class Reader {
 public:
  /// Opens a file. Errors: bad_data if the magic number is missing.
  static Result<Reader> open(std::unique_ptr<Source> source);

  std::optional<Message> next();
  /// Returns the channels of the messages so far.
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
  std::optional<Error> damage() const { return damages_.error(source_->name()); }
  /// Returns the damages, to which callers may add damage in messages; rewind() clears them.
  Damages& damages() { return damages_; }
  void rewind();

 private:
  explicit Reader(std::unique_ptr<Source> source);
  std::optional<Message> take_record(std::uint64_t end, bool in_chunk);
  std::optional<Message> take_message(BytesView content, std::uint64_t at);
  void take_description(Opcode code, BytesView content, std::uint64_t at);
  void enter_chunk(std::uint64_t at, std::uint64_t length, bool is_cut);
  bool is_chunk_sound(std::uint64_t from, std::uint64_t size, std::uint32_t crc);
  void stop(std::string why);
  void end_at(std::uint64_t at);

  std::unique_ptr<Source> source_;
  Scan scan_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::uint64_t described_bytes_ = 0;  // bytes of the schemas and channels that were read
  Damages damages_;
  std::uint64_t chunk_end_ = 0;  // 0 = not in a chunk
  bool ended_ = false;
};

}  // namespace sonar::recording::mcap
