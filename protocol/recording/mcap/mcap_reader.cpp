#include "protocol/recording/mcap/mcap_reader.hpp"

#include <algorithm>

#include "protocol/recorded/byte_source.hpp"

namespace sonar::recording::mcap {
namespace {

std::string text_from(BytesView bytes) {
  std::string text(bytes.size(), '\0');
  std::transform(bytes.begin(), bytes.end(), text.begin(), [](std::byte b) { return static_cast<char>(b); });
  return text;
}

void set_u64(Bytes& out, std::size_t at, std::uint64_t value) {
  for (std::size_t i = 0; i < 8; ++i) out[at + i] = static_cast<std::byte>(value >> 8 * i & 0xFFu);
}

}  // namespace

void RecordWriter::string(std::string_view text) {
  number(static_cast<std::uint32_t>(text.size()));
  std::transform(text.begin(), text.end(), std::back_inserter(out_), [](char c) { return static_cast<std::byte>(c); });
}

void RecordWriter::strings(const std::map<std::string, std::string>& map) {
  std::size_t size = 0;
  for (const auto& [key, value] : map) size += 8 + key.size() + value.size();
  number(static_cast<std::uint32_t>(size));
  for (const auto& [key, value] : map) {
    string(key);
    string(value);
  }
}

// The length of a record is not known yet; end() writes it into this place.
void RecordWriter::begin(Opcode code) {
  number(code);
  length_at_ = out_.size();
  number(std::uint64_t{0});
}

void RecordWriter::end() { set_u64(out_, length_at_, out_.size() - length_at_ - 8); }

std::string RecordReader::string() { return text_from(bytes(number<std::uint32_t>())); }

// A map states its length in bytes, not its number of entries.
std::map<std::string, std::string> RecordReader::strings() {
  RecordReader inside(bytes(number<std::uint32_t>()));
  std::map<std::string, std::string> map;
  while (inside.ok() && inside.reader_.remaining() > 0) {
    std::string key = inside.string();
    map.insert_or_assign(std::move(key), inside.string());
  }
  return map;
}

void append(Bytes& out, const Schema& schema) {
  RecordWriter record(out);
  record.begin(Opcode::schema);
  record.number(schema.id);
  record.string(schema.name);
  record.string(schema.encoding);
  record.number(static_cast<std::uint32_t>(schema.data.size()));
  record.bytes(schema.data);
  record.end();
}

void append(Bytes& out, const Channel& channel) {
  RecordWriter record(out);
  record.begin(Opcode::channel);
  record.number(channel.id);
  record.number(channel.schema);
  record.string(channel.topic);
  record.string(channel.message_encoding);
  record.strings(channel.metadata);
  record.end();
}

std::optional<Schema> read_schema(BytesView content) {
  RecordReader record(content);
  Schema schema;
  schema.id = record.number<std::uint16_t>();
  schema.name = record.string();
  schema.encoding = record.string();
  record.bytes(record.number<std::uint32_t>());  // the data, unused
  if (!record.ok()) return std::nullopt;
  return schema;
}

std::optional<Channel> read_channel(BytesView content) {
  RecordReader record(content);
  Channel channel;
  channel.id = record.number<std::uint16_t>();
  channel.schema = record.number<std::uint16_t>();
  channel.topic = record.string();
  channel.message_encoding = record.string();
  channel.metadata = record.strings();
  if (!record.ok()) return std::nullopt;
  return channel;
}

namespace {

constexpr std::size_t most_channels = 4096;
constexpr std::size_t most_summary_records = 1 << 20;
constexpr std::uint64_t most_described_bytes = 16 << 20;  // limit for all schemas and channels that are kept

/// True if a record without messages is valid here and is skipped. Applications define records from 0x80 on, and later versions
/// of the format may add others, also to chunks (https://mcap.dev/spec, "Records").
bool is_skipped(Opcode code, bool in_chunk) { return !in_chunk || code > Opcode::data_end; }

std::string at_byte(std::uint64_t at) { return " at byte " + std::to_string(at); }

}  // namespace

Reader::Reader(std::unique_ptr<Source> source) : source_(std::move(source)), scan_(*source_, magic.size()) {}

Result<Reader> Reader::open(std::unique_ptr<Source> source) {
  std::array<std::byte, magic.size()> front{};
  const std::size_t there = source->read_at(0, front);
  const bool right =
      there == front.size() && std::equal(front.begin(), front.end(), magic.begin(),
                                          [](std::byte a, std::uint8_t b) { return std::to_integer<std::uint8_t>(a) == b; });
  if (!right) return failure(ErrorKind::bad_data, source->name() + " is not an MCAP file");
  return Reader(std::move(source));
}

void Reader::rewind() {
  scan_.seek(magic.size());
  schemas_.clear();
  channels_.clear();
  described_bytes_ = 0;
  damages_.clear();
  chunk_end_ = 0;
  ended_ = false;
}

void Reader::stop(std::string why) {
  damages_.add(std::move(why));
  ended_ = true;
}

std::optional<Message> Reader::next() {
  while (!ended_) {
    if (chunk_end_ != 0 && scan_.position() >= chunk_end_) {
      scan_.seek(chunk_end_);
      chunk_end_ = 0;
    }
    const bool in_chunk = chunk_end_ != 0;
    if (auto message = take_record(in_chunk ? chunk_end_ : source_->size(), in_chunk)) return message;
  }
  return std::nullopt;
}

/// Reads one record, which ends before `end`; returns the message if the record is one. After damage in a chunk the rest of the
/// chunk is skipped; outside chunks damage ends the reading, because the start of the next record is unknown.
std::optional<Message> Reader::take_record(std::uint64_t end, bool in_chunk) {
  const std::uint64_t at = scan_.position();
  const auto give_up = [&](std::string why) {
    if (!in_chunk) return stop(std::move(why));
    damages_.add(std::move(why));
    scan_.seek(chunk_end_);
  };
  if (end - at < record_front_bytes) {
    if (end == at && damages_.any())
      ended_ = true;  // the missing part has been reported
    else
      give_up("the file ends" + at_byte(at) + " without the end of its data: it was not closed");
    return std::nullopt;
  }
  RecordReader front(scan_.read(record_front_bytes));
  const auto code = front.number<Opcode>();
  const auto length = front.number<std::uint64_t>();
  // A program that was killed leaves a cut chunk at the end, whose whole records are valid.
  if (code == Opcode::chunk && !in_chunk && length > end - scan_.position()) {
    damages_.add("the chunk" + at_byte(at) + " is cut short by the end of the file");
    enter_chunk(at, end - scan_.position(), true);
    return std::nullopt;
  }
  if (code == Opcode::none) {  // zeros of a file that a crash left incomplete
    give_up("the record" + at_byte(at) + " has the opcode 0, which no record has");
    return std::nullopt;
  }
  if (!front.ok() || length > end - scan_.position()) {
    give_up("the record" + at_byte(at) + " is cut short by the end of the " + (in_chunk ? "chunk" : "file"));
    return std::nullopt;
  }
  const std::uint64_t record_end = scan_.position() + length;
  if (!in_chunk && (code == Opcode::data_end || code == Opcode::footer)) {
    end_at(at);
    return std::nullopt;
  } else if (code == Opcode::chunk && !in_chunk) {
    enter_chunk(at, length, false);
    if (chunk_end_ != 0) return std::nullopt;
  } else if (code == Opcode::message || code == Opcode::schema || code == Opcode::channel) {
    const bool is_message = code == Opcode::message, is_long = length > (is_message ? longest_record : longest_description);
    const BytesView content = is_long ? BytesView{} : scan_.read(static_cast<std::size_t>(length));
    if (is_long) {
      damages_.add("the record" + at_byte(at) + " is too long, " + std::to_string(length) + " bytes");
    } else if (is_message) {
      auto message = take_message(content, at);
      scan_.seek(record_end);
      return message;
    } else {
      take_description(code, content, at);
    }
  } else if (!is_skipped(code, in_chunk)) {
    damages_.add("the record" + at_byte(at) + " has the opcode " + std::to_string(static_cast<unsigned>(code)) +
                 ", which no record of a chunk has");
  }
  scan_.seek(record_end);
  return std::nullopt;
}

/// Finds the end of the file's summary. Bytes after it, such as a second file, are not read. `at`: position of the record after
/// all data.
void Reader::end_at(std::uint64_t at) {
  ended_ = true;
  for (std::size_t looked_at = 0; looked_at < most_summary_records; ++looked_at) {
    if (source_->size() - at < record_front_bytes) return;
    scan_.seek(at);
    RecordReader front(scan_.read(record_front_bytes));
    const auto code = front.number<Opcode>();
    const auto length = front.number<std::uint64_t>();
    if (!front.ok() || length > source_->size() - at - record_front_bytes) return;  // all data were read
    at += record_front_bytes + length;
    if (code != Opcode::footer) continue;
    at += magic.size();
    if (at < source_->size())
      damages_.add(std::to_string(source_->size() - at) + " bytes after the end of the recording" + at_byte(at) +
                   " are not read: are several files joined in this one?");
    return;
  }
}

/// Keeps a schema or a channel. Files may repeat them in each chunk; the first applies.
void Reader::take_description(Opcode code, BytesView content, std::uint64_t at) {
  bool is_new = false;
  if (code == Opcode::schema) {
    auto schema = read_schema(content);
    is_new = schema && schemas_.size() < most_channels && schemas_.try_emplace(schema->id, std::move(*schema)).second;
  } else if (auto channel = read_channel(content)) {
    if (channels_.contains(channel->id)) return;
    if (channels_.size() >= most_channels || described_bytes_ + content.size() > most_described_bytes)
      return damages_.add("the channel" + at_byte(at) + " is ignored: the file describes too many channels");
    is_new = channels_.try_emplace(channel->id, std::move(*channel)).second;
  } else {
    damages_.add("the channel" + at_byte(at) + " cannot be read");
  }
  if (is_new) described_bytes_ += content.size();
}

/// Reads the content of a message record. Returns nullopt if it is damaged, or belongs to a channel that was not read.
std::optional<Message> Reader::take_message(BytesView content, std::uint64_t at) {
  RecordReader record(content);
  Message message;
  message.at = at;
  message.channel = record.number<std::uint16_t>();
  message.sequence = record.number<std::uint32_t>();
  message.logged_at = record.time();
  message.published_at = record.time();
  const BytesView data = record.rest();
  if (!record.ok() || !channels_.contains(message.channel)) {
    damages_.add("the message" + at_byte(at) + (record.ok() ? " belongs to no channel" : " is shorter than its fields"));
    return std::nullopt;
  }
  message.data.assign(data.begin(), data.end());
  return message;
}

/// Enters a chunk, whose end is then chunk_end_, or skips it if it is damaged or compressed. The checksum of a chunk that is cut
/// short cannot be compared, so its whole records are read unchecked.
void Reader::enter_chunk(std::uint64_t at, std::uint64_t length, bool is_cut) {
  const std::uint64_t end = scan_.position() + length;
  // 40 bytes of numbers, and the name of a compression, which is short.
  const std::size_t front_bytes = static_cast<std::size_t>(std::min<std::uint64_t>(length, 40 + 256));
  const std::uint64_t content = scan_.position();
  RecordReader front(scan_.peek(front_bytes));
  front.time();
  front.time();
  const auto size = front.number<std::uint64_t>();
  const auto crc = front.number<std::uint32_t>();
  const std::string compression = front.string();
  const auto stored = front.number<std::uint64_t>();
  scan_.seek(end);
  if (!front.ok()) return damages_.add("the chunk" + at_byte(at) + " has an invalid header");
  const std::uint64_t begin = content + 28 + 4 + compression.size() + 8;
  if (!compression.empty())
    return damages_.add("the chunk" + at_byte(at) + " is compressed (" + compression.substr(0, 16) +
                        "), which is not read: write the file without compression");
  if (stored != size || (!is_cut && stored != end - begin))
    return damages_.add("the chunk" + at_byte(at) + " does not have its stated size");
  if (!is_cut && crc != 0 && !is_chunk_sound(begin, size, crc))
    return damages_.add("the chunk" + at_byte(at) + " is damaged (CRC): its messages are skipped");
  scan_.seek(begin);
  if (begin < end) chunk_end_ = end;
}

/// Compares the checksum of a chunk, which is read in blocks to save memory.
bool Reader::is_chunk_sound(std::uint64_t from, std::uint64_t size, std::uint32_t crc) {
  std::uint32_t found = 0;
  scan_.seek(from);
  for (std::uint64_t left = size; left > 0;) {
    const BytesView block = scan_.read(static_cast<std::size_t>(std::min<std::uint64_t>(left, 256 << 10)));
    if (block.empty()) return false;
    found = crc32(block, found);
    left -= block.size();
  }
  return found == crc;
}

}  // namespace sonar::recording::mcap
