#include "protocol/recorded/raw_dump.hpp"

#include <utility>

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
