#include "protocol/recorded/message_splitter.hpp"

#include <algorithm>
#include <utility>

namespace sonar::recording {
namespace {

bool begins_with(wire::BytesView bytes, const std::array<std::uint8_t, 2>& magic) {
  return !bytes.empty() && bytes[0] == std::byte{magic[0]} && (bytes.size() < 2 || bytes[1] == std::byte{magic[1]});
}

constexpr std::size_t longest_line = 1 << 16;

/// Returns the length of the line with its end; 0 if the end has not arrived yet; nullopt if the bytes are too long for a line.
std::optional<std::size_t> length_of_line(wire::BytesView waiting) {
  const auto end = std::find(waiting.begin(), waiting.end(), std::byte{'\n'});
  if (end != waiting.end()) return static_cast<std::size_t>(end - waiting.begin()) + 1;
  return waiting.size() < longest_line ? std::optional<std::size_t>(0) : std::nullopt;
}

}  // namespace

bool Framing::begins_message(wire::BytesView bytes, Origin from) const {
  if (bytes.size() < header_size || !begins_with(bytes, magic)) return false;
  return length == nullptr || length(bytes.first(header_size), from, true);
}

bool MessageSplitter::starts_like_header(wire::BytesView bytes) const { return begins_with(bytes, framing_->magic); }

void MessageSplitter::append(Time at, wire::BytesView bytes) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  at_ = at;
  finished_ = false;
}

RecordedMessage MessageSplitter::cut(std::size_t count) {
  const auto bytes = wire::BytesView(buffer_).subspan(begin_, count);
  begin_ += count;
  return {at_, from_, Carrier::stream, {bytes.begin(), bytes.end()}};
}

void MessageSplitter::lose(std::size_t count) {
  begin_ += count;
  lost_bytes_ += count;
}

// Bytes are missing after the waiting ones, so the incomplete message is lost, and the next bytes may be in the middle of
// another message.
void MessageSplitter::break_off() {
  if (waiting_bytes() > 0) ++losses_;
  lose(waiting_bytes());
  lost_ = strict_ = true;
}

/// Returns the length of the message that begins here; 0 if it is not known yet; nullopt if no message begins here. After lost
/// bytes (strict_) only headers of known types count, because the two bytes of the magic number often occur in an image by
/// chance.
std::optional<std::size_t> MessageSplitter::length_at_front(wire::BytesView waiting) const {
  if (!starts_like_header(waiting)) return std::nullopt;
  if (waiting.size() < framing_->header_size) return 0;
  if (framing_->length == nullptr) return length_of_line(waiting);
  return framing_->length(waiting.first(framing_->header_size), from_, strict_);
}

std::optional<RecordedMessage> MessageSplitter::next() {
  while (waiting_bytes() > 0) {
    const auto waiting = wire::BytesView(buffer_).subspan(begin_);
    if (const auto length = length_at_front(waiting)) {
      if (*length > 0 && waiting.size() >= *length) {
        lost_ = strict_ = false;
        return cut(*length);
      }
      if (!finished_) return std::nullopt;
      // The stream ends within this message. The search continues inside the message, because it may be a false start.
      if (!lost_) ++losses_;
      lost_ = strict_ = true;
      lose(1);
      continue;
    }
    strict_ = true;
    std::size_t none = 1;
    while (none < waiting.size() && !starts_like_header(waiting.subspan(none))) ++none;
    // Bytes between messages are returned as they are, except after a gap, where they may be the rest of a message.
    if (!lost_) return cut(none);
    lose(none);
  }
  return std::nullopt;
}

void MessageSplitter::finish() { finished_ = true; }

namespace {

/// Returns the length of the message that begins here; 0 if none begins here, or if its end is missing.
std::size_t message_at_front(wire::BytesView bytes, const Framing& framing) {
  if (bytes.size() < std::max<std::size_t>(framing.header_size, 2)) return 0;
  if (bytes[0] != std::byte{framing.magic[0]} || bytes[1] != std::byte{framing.magic[1]}) return 0;
  if (framing.length == nullptr) {
    const auto end = std::find(bytes.begin(), bytes.end(), std::byte{'\n'});
    return end == bytes.end() ? 0 : static_cast<std::size_t>(end - bytes.begin()) + 1;
  }
  const std::size_t length = framing.length(bytes.first(framing.header_size), Origin::device, false).value_or(0);
  return length <= bytes.size() ? length : 0;
}

}  // namespace

std::size_t JunkReport::whole_messages(wire::BytesView bytes) const {
  std::size_t whole = 0;
  while (const std::size_t length = message_at_front(bytes.subspan(whole), *framing_)) whole += length;
  return whole;
}

void JunkReport::end(Damages& damages) {
  const std::uint64_t count = std::exchange(count_, 0);
  if (count > 0)
    damages.add((count == 1 ? "1 byte" : std::to_string(count) + " bytes") + " from " + place_ + " on belong to no message");
}

namespace {

constexpr std::size_t dump_block_bytes = 256 << 10;

/// Reads the file in blocks and splits it into messages. A raw dump has no times, so all are 0.
class RawReader final : public RecordingReader {
 public:
  RawReader(std::unique_ptr<Source> source, const Framing& framing)
      : source_(std::move(source)), framing_(framing), scan_(*source_) {}

  std::optional<RecordedMessage> next() override {
    while (true) {
      if (auto message = next_of_block()) return message;
      if (ended_) break;
      if (const BytesView block = scan_.read(dump_block_bytes); !block.empty()) {
        splitter_.append({}, block);
        continue;
      }
      ended_ = true;
      unfinished_ = splitter_.waiting_bytes();
      splitter_.finish();
    }
    report_end();
    return std::nullopt;
  }
  std::optional<Error> damage() const override { return damages_.error(source_->name()); }
  void rewind() override {
    scan_.seek(0);
    splitter_ = MessageSplitter(Origin::device, framing_);
    junk_ = JunkReport(&framing_);
    damages_.clear();
    returned_ = 0;
    ended_ = reported_ = false;
  }
  bool knows_times() const override { return false; }

 private:
  /// Returns the next message of the bytes that were read, or bytes between messages, which may come in several parts.
  std::optional<RecordedMessage> next_of_block() {
    auto next = splitter_.next();
    if (!next) return next;
    junk_.take(
        next->bytes, [this] { return "byte " + std::to_string(returned_ + splitter_.lost_bytes()); }, damages_);
    returned_ += next->bytes.size();
    return next;
  }
  void report_end() {
    if (std::exchange(reported_, true)) return;
    junk_.end(damages_);
    if (scan_.left() > 0)
      damages_.add("cannot be read from byte " + std::to_string(scan_.position()) + " on");
    else if (splitter_.losses() > 0)
      damages_.add("the file ends at byte " + std::to_string(source_->size()) + " within a message: only " +
                   std::to_string(unfinished_) + " bytes of it are there");
  }

  std::unique_ptr<Source> source_;
  const Framing& framing_;
  Scan scan_;
  MessageSplitter splitter_{Origin::device, framing_};
  Damages damages_;
  JunkReport junk_{&framing_};
  std::uint64_t returned_ = 0;
  std::size_t unfinished_ = 0;  // bytes of the message within which the stream ends
  bool ended_ = false, reported_ = false;
};

/// Writes the bytes of the device unchanged. Times and the client's messages are lost.
class RawWriter final : public RecordingWriter {
 public:
  RawWriter(std::unique_ptr<Sink> sink, Carrier by) : sink_(std::move(sink)), by_(by) {}
  Result<void> write(const RecordedMessage& message) override {
    if (message.from != Origin::device || message.by != by_) return {};
    return sink_->append(message.bytes);
  }
  Result<void> close() override { return sink_->close(); }

 private:
  std::unique_ptr<Sink> sink_;
  Carrier by_;
};

}  // namespace

Result<std::unique_ptr<RecordingReader>> read_raw_dump(std::unique_ptr<Source> source, const Framing& framing) {
  Scan scan(*source);
  if (!framing.begins_message(scan.read(framing.header_size), Origin::device))
    return failure(ErrorKind::bad_data, source->name() + " does not begin with a message of a sonar");
  return std::make_unique<RawReader>(std::move(source), framing);
}

std::unique_ptr<RecordingWriter> write_raw_dump(std::unique_ptr<Sink> sink, Carrier by) {
  return std::make_unique<RawWriter>(std::move(sink), by);
}

}  // namespace sonar::recording
