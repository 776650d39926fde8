#include "protocol/recording/mcap/mcap_writer.hpp"

#include <algorithm>

#include "protocol/recorded/byte_source.hpp"

namespace sonar::recording::mcap {

std::uint16_t Writer::add_schema(std::string name, std::string encoding, Bytes data) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back({id, std::move(name), std::move(encoding), std::move(data)});
  return id;
}

std::uint16_t Writer::add_channel(Channel channel) {
  channel.id = static_cast<std::uint16_t>(channels_.size());
  channels_.push_back(std::move(channel));
  next_sequence_.push_back(0);
  // Channels without a message are not written at all.
  announced_.push_back(false);
  announced_before_.push_back(false);
  return channels_.back().id;
}

/// Appends to the file, and keeps position and checksum of the data section. After an error all later calls fail.
Result<void> Writer::put(const Bytes& bytes) {
  if (broken_) return tl::unexpected(*broken_);
  if (Result<void> written = sink_->append(bytes); !written) {
    broken_ = written.error();
    return written;
  }
  position_ += bytes.size();
  data_crc_ = crc32(bytes, data_crc_);
  return {};
}

Result<void> Writer::begin() {
  if (std::exchange(begun_, true)) return {};
  Bytes front;
  RecordWriter record(front);
  for (const std::uint8_t b : magic) record.number(b);
  record.begin(Opcode::header);
  record.string("");        // no profile
  record.string("sonard");  // library
  record.end();
  return put(front);
}

/// Writes a channel, and before it its schema, unless `schemas` marks it as written.
void Writer::announce(Bytes& out, const Channel& channel, std::vector<bool>& schemas) const {
  if (channel.schema != 0 && !schemas[channel.schema - 1u]) {
    append(out, schemas_[channel.schema - 1u]);
    schemas[channel.schema - 1u] = true;
  }
  append(out, channel);
}

Result<void> Writer::write(std::uint16_t channel, Time at, BytesView data) {
  if (Result<void> begun = begin(); !begun) return begun;
  if (broken_) return tl::unexpected(*broken_);
  const bool late = entries_.size() > 0 && at - chunk_first_ > longest_chunk_time;
  if (late)
    if (Result<void> ended = end_chunk(); !ended) return ended;
  if (entries_.empty()) chunk_first_ = chunk_last_ = at;
  chunk_first_ = std::min(chunk_first_, at);
  chunk_last_ = std::max(chunk_last_, at);
  if (!announced_[channel]) {  // the channel must precede its first message
    std::vector<bool> schemas(schemas_.size());
    for (const Channel& each : channels_)
      if (announced_[each.id] && each.schema != 0) schemas[each.schema - 1u] = true;
    announce(chunk_, channels_[channel], schemas);
    announced_[channel] = true;
  }
  entries_[channel].emplace_back(at, chunk_.size());
  RecordWriter record(chunk_);
  record.begin(Opcode::message);
  record.number(channel);
  record.number(next_sequence_[channel]++);
  record.time(at);
  record.time(at);
  record.bytes(data);
  record.end();
  return chunk_.size() < chunk_bytes ? Result<void>{} : end_chunk();
}

Result<void> Writer::end_chunk() {
  if (entries_.empty()) return {};
  Bytes out;
  out.reserve(chunk_.size() + 4096);
  RecordWriter record(out);
  record.begin(Opcode::chunk);
  record.time(chunk_first_);
  record.time(chunk_last_);
  record.number(std::uint64_t{chunk_.size()});
  record.number(crc32(chunk_));
  record.string("");  // not compressed
  record.number(std::uint64_t{chunk_.size()});
  record.bytes(chunk_);
  record.end();
  ChunkPlace place{chunk_first_, chunk_last_, position_, out.size(), 0, chunk_.size(), {}};
  append_message_indexes(out, place);
  if (Result<void> written = put(out); !written) return written;
  chunks_.push_back(std::move(place));
  for (const auto& [channel, entries] : entries_) counts_[channel] += entries.size();
  announced_before_ = announced_;
  chunk_.clear();
  entries_.clear();
  return {};
}

/// Appends message indexes. A message index lists time and offset of each message of one channel in the preceding chunk.
void Writer::append_message_indexes(Bytes& out, ChunkPlace& place) const {
  for (const auto& [channel, entries] : entries_) {
    place.index_offsets[channel] = position_ + out.size();
    RecordWriter record(out);
    record.begin(Opcode::message_index);
    record.number(channel);
    record.number(static_cast<std::uint32_t>(16 * entries.size()));
    for (const auto& [at, offset] : entries) {
      record.time(at);
      record.number(offset);
    }
    record.end();
  }
  place.index_length = out.size() - place.length;
}

/// Appends the record with which viewers find the chunks of a time without reading other chunks.
void Writer::append_chunk_index(Bytes& out, const ChunkPlace& place) {
  RecordWriter record(out);
  record.begin(Opcode::chunk_index);
  record.time(place.first);
  record.time(place.last);
  record.number(place.offset);
  record.number(place.length);
  record.number(static_cast<std::uint32_t>(10 * place.index_offsets.size()));
  for (const auto& [channel, offset] : place.index_offsets) {
    record.number(channel);
    record.number(offset);
  }
  record.number(place.index_length);
  record.string("");
  record.number(place.size);
  record.number(place.size);
  record.end();
}

void Writer::append_statistics(Bytes& out) const {
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : counts_) messages += count;
  std::vector<bool> schemas(schemas_.size());
  for (const Channel& channel : channels_)
    if (announced_before_[channel.id] && channel.schema != 0) schemas[channel.schema - 1u] = true;
  Time first{}, last{};
  for (const ChunkPlace& chunk : chunks_) {
    first = &chunk == &chunks_.front() ? chunk.first : std::min(first, chunk.first);
    last = std::max(last, chunk.last);
  }
  RecordWriter record(out);
  record.begin(Opcode::statistics);
  record.number(messages);
  record.number(static_cast<std::uint16_t>(std::count(schemas.begin(), schemas.end(), true)));
  record.number(static_cast<std::uint32_t>(std::count(announced_before_.begin(), announced_before_.end(), true)));
  record.number(std::uint32_t{0});  // attachments
  record.number(std::uint32_t{0});  // metadata
  record.number(static_cast<std::uint32_t>(chunks_.size()));
  record.time(first);
  record.time(last);
  record.number(static_cast<std::uint32_t>(10 * counts_.size()));
  for (const auto& [channel, count] : counts_) {
    record.number(channel);
    record.number(count);
  }
  record.end();
}

/// Makes the summary: groups of records, one group for each kind; the position of each group; the footer up to its checksum.
Bytes Writer::summary() const {
  Bytes out;
  const std::uint64_t start = position_;
  struct Group {
    Opcode code{};
    std::uint64_t offset = 0, length = 0;
  };
  std::vector<Group> groups;
  const auto group = [&](Opcode code, const auto& fill) {
    const std::size_t begin = out.size();
    fill();
    if (out.size() > begin) groups.push_back({code, start + begin, out.size() - begin});
  };
  std::vector<bool> schemas(schemas_.size());
  Bytes channels;
  group(Opcode::schema, [&] {
    for (const Channel& channel : channels_) {
      if (!announced_before_[channel.id]) continue;
      if (channel.schema != 0 && !schemas[channel.schema - 1u]) append(out, schemas_[channel.schema - 1u]);
      if (channel.schema != 0) schemas[channel.schema - 1u] = true;
      append(channels, channel);
    }
  });
  group(Opcode::channel, [&] { out.insert(out.end(), channels.begin(), channels.end()); });
  group(Opcode::statistics, [&] { append_statistics(out); });
  group(Opcode::chunk_index, [&] {
    for (const ChunkPlace& chunk : chunks_) append_chunk_index(out, chunk);
  });
  const std::uint64_t offsets = start + out.size();
  RecordWriter record(out);
  for (const Group& each : groups) {
    record.begin(Opcode::summary_offset);
    record.number(each.code);
    record.number(each.offset);
    record.number(each.length);
    record.end();
  }
  record.number(Opcode::footer);
  record.number(std::uint64_t{20});
  record.number(start);
  record.number(offsets);
  return out;
}

Result<void> Writer::close() {
  if (!broken_)
    if (begin()) static_cast<void>(end_chunk());
  // After an error, as on a full disk, the chunk that failed is left out. The summary of the other chunks is smaller and may
  // still fit.
  const std::optional<Error> first_error = broken_;
  if (first_error) sink_->try_again();
  Bytes end;
  RecordWriter record(end);
  record.begin(Opcode::data_end);
  record.number(data_crc_);
  record.end();
  position_ += end.size();
  Bytes rest = summary();
  RecordWriter footer(rest);
  footer.number(crc32(rest));
  for (const std::uint8_t b : magic) footer.number(b);
  end.insert(end.end(), rest.begin(), rest.end());
  const Result<void> written = position_ > end.size() || !first_error ? sink_->append(end) : Result<void>{};
  const Result<void> closed = sink_->close();
  if (first_error) return tl::unexpected(*first_error);
  return written ? closed : written;
}

}  // namespace sonar::recording::mcap
