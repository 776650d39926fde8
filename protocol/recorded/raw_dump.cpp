#include "protocol/recorded/raw_dump.hpp"

#include <algorithm>

namespace sonar::recording {
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
      if (scan_.left() == 0) return end();
      const BytesView block = scan_.read(dump_block_bytes);
      if (block.empty()) return unreadable();
      splitter_.append({}, block);
    }
  }
  std::optional<Error> damage() const override { return damages_.error(source_->name()); }
  void rewind() override {
    scan_.seek(0);
    splitter_ = MessageSplitter(Origin::device, framing_);
    damages_.clear();
    returned_ = junk_bytes_ = 0;
    ended_ = false;
  }
  bool knows_times() const override { return false; }

 private:
  /// The next message of the bytes that were read, or bytes between messages. A run of these may come in several parts.
  std::optional<RecordedMessage> next_of_block() {
    auto next = splitter_.next();
    if (!next) return next;
    if (is_message(next->bytes)) {
      report_junk();
    } else {
      if (junk_bytes_ == 0) junk_begin_ = returned_ + splitter_.lost_bytes();
      junk_bytes_ += next->bytes.size();
    }
    returned_ += next->bytes.size();
    return next;
  }
  bool is_message(BytesView bytes) const {
    const auto begins_with_magic = [&] {
      return bytes[0] == std::byte{framing_.magic[0]} && bytes[1] == std::byte{framing_.magic[1]};
    };
    if (bytes.size() < std::max<std::size_t>(framing_.header_size, 2) || !begins_with_magic()) return false;
    if (framing_.length == nullptr) return bytes.back() == std::byte{'\n'};
    return framing_.length(bytes.first(framing_.header_size), Origin::device, false) == bytes.size();
  }
  void report_junk() {
    if (const std::uint64_t bytes = std::exchange(junk_bytes_, 0); bytes > 0)
      damages_.add((bytes == 1 ? "1 byte" : std::to_string(bytes) + " bytes") + " from byte " + std::to_string(junk_begin_) +
                   " on belong to no message");
  }
  /// Ends the stream. The first call reports an unfinished message and returns the first of the remaining bytes outside
  /// messages.
  std::optional<RecordedMessage> end() {
    if (std::exchange(ended_, true)) {
      report_junk();
      return std::nullopt;
    }
    const std::size_t unfinished = splitter_.waiting_bytes();
    splitter_.finish();
    auto last = next_of_block();
    if (!last) report_junk();
    if (splitter_.losses() > 0)
      damages_.add("the file ends at byte " + std::to_string(source_->size()) + " within a message: only " +
                   std::to_string(unfinished) + " bytes of it are there");
    return last;
  }
  std::optional<RecordedMessage> unreadable() {
    if (!std::exchange(ended_, true)) damages_.add("cannot be read from byte " + std::to_string(scan_.position()) + " on");
    return std::nullopt;
  }

  std::unique_ptr<Source> source_;
  const Framing& framing_;
  Scan scan_;
  MessageSplitter splitter_{Origin::device, framing_};
  Damages damages_;
  std::uint64_t returned_ = 0, junk_begin_ = 0,
                junk_bytes_ = 0;  // junk: the run of bytes outside messages that is not reported yet
  bool ended_ = false;
};

/// Writes the bytes of the device as they are. Times and the client's messages are lost.
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
