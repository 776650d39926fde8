// Reads the messages of an MCAP file from start to end, chunk by chunk; it needs no summary, so a file truncated by a crash or
// a full disk is readable. It reads only uncompressed chunks, and skips chunks with a wrong CRC.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/base/units.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording::mcap {

// The records of an MCAP file (mcap.dev, version 0), for writer and reader: an opcode, a length, and little-endian fields;
// strings and maps follow their length.

inline constexpr std::array<std::uint8_t, 8> magic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum class Opcode : std::uint8_t {
  none = 0x00,  // no record has it
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F,
};
inline constexpr std::size_t record_front_bytes = 9;         // opcode and length
inline constexpr std::size_t longest_record = 64 << 20;      // limit for files of other programs; chunks are not read whole
inline constexpr std::size_t longest_description = 1 << 20;  // limit for a schema or channel
inline constexpr std::uint64_t latest_time_ns = 4'000'000'000'000'000'000u;  // in 2096; later times are damage

struct Schema {
  std::uint16_t id = 0;  // must not be 0
  std::string name, encoding;
  Bytes data;  // only written, not read
};
struct Channel {
  std::uint16_t id = 0, schema = 0;  // schema 0 = none
  std::string topic, message_encoding;
  std::map<std::string, std::string> metadata;
};
struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  Time logged_at{}, published_at{};
  Bytes data;
  std::uint64_t at = 0;  // offset of its record in the file, which the reader sets
};

/// Appends records: begin(), then the fields, then end().
class RecordWriter {
 public:
  explicit RecordWriter(Bytes& out) : out_(out), writer_(out) {}
  template <class T>
  void number(T value) {
    const T kept = value;
    writer_("number", kept);
  }
  void time(Time at) { number(static_cast<std::uint64_t>(at.time_since_epoch().count())); }
  void string(std::string_view text);
  void strings(const std::map<std::string, std::string>& map);
  void bytes(BytesView data) { out_.insert(out_.end(), data.begin(), data.end()); }

  void begin(Opcode code);
  void end();

 private:
  Bytes& out_;
  wire::Writer writer_;
  std::size_t length_at_ = 0;
};

/// Reads fields of a record's content; ok() is false after a missing field.
class RecordReader {
 public:
  explicit RecordReader(BytesView content) : reader_(content) {}
  template <class T>
  T number() {
    T value{};
    reader_("number", value);
    return value;
  }
  /// Reads a time. An invalid time becomes 1970, so that differences of times never overflow.
  Time time() {
    const auto since_1970_ns = number<std::uint64_t>();
    return since_1970_ns > latest_time_ns ? Time{} : Time(std::chrono::nanoseconds(static_cast<std::int64_t>(since_1970_ns)));
  }
  std::string string();
  std::map<std::string, std::string> strings();
  BytesView bytes(std::size_t count) { return reader_.block("bytes", count); }
  BytesView rest() { return reader_.block("rest", reader_.remaining()); }
  bool ok() const { return reader_.ok(); }

 private:
  wire::Reader reader_;
};

void append(Bytes& out, const Schema& schema);
void append(Bytes& out, const Channel& channel);
std::optional<Schema> read_schema(BytesView content);
std::optional<Channel> read_channel(BytesView content);

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
