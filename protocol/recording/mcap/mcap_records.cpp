#include "protocol/recording/mcap/mcap_records.hpp"

#include <algorithm>

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

}  // namespace sonar::recording::mcap
