#include "protocol/oculus/oculus_log.hpp"

#include <cmath>

#include "protocol/oculus/framer.hpp"
#include "protocol/recorded/byte_source.hpp"

namespace sonar::recording {
namespace {

constexpr std::size_t file_header_bytes = wire::wire_size<OculusLogHeader>(), item_bytes = wire::wire_size<OculusLogItem>();
constexpr std::size_t most_payload = oculus::reply_limit + 1024;  // limit for an item with a message; other items are skipped

template <class M>
M read_as(BytesView bytes) {
  M message;
  wire::Reader reader(bytes);
  fields(reader, message);
  return message;
}

/// Returns the time in an item's header. A double has present UNIX seconds with a precision of 0.25 us, so items of type 1010
/// state the exact time. An invalid time becomes 1970.
Time time_of(double unix_s) {
  if (!std::isfinite(unix_s) || std::abs(unix_s) > 4e9) return {};
  return Time(nanoseconds_from(unix_s));
}
Time time_of(const OculusLogTime& t) {
  if (t.seconds > 4'000'000'000u || t.nanoseconds >= 1'000'000'000u) return {};
  return Time(std::chrono::seconds(t.seconds) + std::chrono::nanoseconds(t.nanoseconds));
}

bool is_item(const OculusLogItem& item) { return item.magic == OculusLogItem{}.magic && item.size == item_bytes; }

/// Reads item by item. After a damaged item it searches for the magic number of the next item; items of other types are skipped.
class LogReader final : public RecordingReader {
 public:
  explicit LogReader(std::unique_ptr<Source> source) : source_(std::move(source)), scan_(*source_, file_header_bytes) {}

  std::optional<RecordedMessage> next() override {
    while (scan_.left() > 0) {
      const std::uint64_t at = scan_.position();
      const BytesView front = scan_.read(item_bytes);
      if (front.size() < item_bytes) return cut(at, "the header of an item");
      const auto item = read_as<OculusLogItem>(front);
      if (!is_item(item)) {
        damages_.add("no item begins at byte " + std::to_string(at));
        if (!find_item(at)) return std::nullopt;
        continue;
      }
      if (item.payload_size > scan_.left()) {
        const std::string size = std::to_string(item.payload_size) + " bytes";
        if (!find_item(at)) return cut(at, "an item of " + size);
        damages_.add("the item at byte " + std::to_string(at) + " is damaged: it would have " + size + ", more than follow");
        continue;
      }
      if (item.type != oculus_message_item) {
        scan_.skip(item.payload_size);
        continue;
      }
      if (auto message = read_message(item, at)) return message;
    }
    return std::nullopt;
  }
  std::optional<Error> damage() const override { return damages_.error(source_->name()); }
  void rewind() override {
    scan_.seek(file_header_bytes);
    damages_.clear();
  }

 private:
  std::optional<RecordedMessage> cut(std::uint64_t at, const std::string& what) {
    damages_.add(what + " at byte " + std::to_string(at) + " is cut short by the end of the file");
    scan_.seek(source_->size());
    return std::nullopt;
  }

  /// Searches for the next item after foreign or damaged bytes. Returns false if there is none.
  bool find_item(std::uint64_t at) {
    for (std::uint64_t from = at + 1; from + item_bytes <= source_->size(); ++from) {
      scan_.seek(from);
      const BytesView front = scan_.peek(item_bytes);
      if (front.size() < item_bytes) break;
      if (front[0] == std::byte{0xDD} && is_item(read_as<OculusLogItem>(front))) return true;
    }
    scan_.seek(source_->size());
    return false;
  }

  /// Reads the message in an item. Returns nullopt if it is damaged, which is noted; the reader then continues with the next
  /// item.
  std::optional<RecordedMessage> read_message(const OculusLogItem& item, std::uint64_t at) {
    const auto refuse = [&](const std::string& why) {
      damages_.add("the message at byte " + std::to_string(at) + " " + why);
      return std::nullopt;
    };
    if (item.payload_size > most_payload) {
      find_item(at);
      return refuse("has " + std::to_string(item.payload_size) + " bytes, more than any message");
    }
    const BytesView payload = scan_.read(item.payload_size);
    RecordedMessage message;
    message.bytes.assign(payload.begin(), payload.end());
    if (item.compression == 1) {
      auto plain = message.bytes.size() < 4 ? std::nullopt : inflate(BytesView(message.bytes).subspan(4), oculus::reply_limit);
      if (!plain) return refuse("does not decompress");
      message.bytes = std::move(*plain);
    } else if (item.compression != 0) {
      return refuse("is compressed in a way that is not known: " + std::to_string(item.compression));
    }
    if (message.bytes.size() < oculus::header_size) return refuse("is shorter than a header");
    const oculus::MessageHeader header = oculus::header_of(message.bytes);
    if (oculus::message_length(header, oculus::Sender::device) != message.bytes.size())
      return refuse("has another length than its header gives");
    if (header.type == oculus::MessageType::status) message.by = Carrier::datagram;
    if (header.type == oculus::MessageType::fire) message.from = Origin::client;
    message.at = exact_time().value_or(time_of(item.at_unix_s));
    return message;
  }

  /// Returns the exact time of the message, if the next item has it. The position does not change, because next() skips such
  /// items.
  std::optional<Time> exact_time() {
    constexpr std::size_t whole = item_bytes + wire::wire_size<OculusLogTime>();
    const BytesView front = scan_.peek(whole);
    if (front.size() < whole) return std::nullopt;
    const auto item = read_as<OculusLogItem>(front);
    if (!is_item(item) || item.type != oculus_time_item || item.payload_size != wire::wire_size<OculusLogTime>() ||
        item.compression != 0)
      return std::nullopt;
    return time_of(read_as<OculusLogTime>(front.subspan(item_bytes)));
  }

  std::unique_ptr<Source> source_;
  Scan scan_;
  Damages damages_;
};

/// Writes each message as two items: the message, and its exact time.
class LogWriter final : public RecordingWriter {
 public:
  explicit LogWriter(std::unique_ptr<Sink> sink) : sink_(std::move(sink)) {}

  Result<void> write(const RecordedMessage& message) override {
    if (message.from != Origin::device || message.by != Carrier::stream || message.bytes.size() < oculus::header_size) return {};
    const auto length = oculus::message_length(oculus::header_of(message.bytes), oculus::Sender::device);
    if (length != message.bytes.size()) return {};
    Bytes record;
    if (!begun_) append_header(record, message.at);
    append_item(record, oculus_message_item, message.at, message.bytes);
    const auto since = message.at.time_since_epoch();
    const auto whole = std::chrono::floor<std::chrono::seconds>(since);
    const OculusLogTime exact{static_cast<std::uint64_t>(whole.count()), static_cast<std::uint64_t>((since - whole).count())};
    append_item(record, oculus_time_item, message.at, wire::bytes_of(exact));
    Result<void> written = sink_->append(record);
    begun_ = begun_ || written;
    return written;
  }
  Result<void> close() override {
    if (!begun_) {  // a file without a message must be valid too
      Bytes header;
      append_header(header, {});
      if (Result<void> written = sink_->append(header); !written) return written;
    }
    return sink_->close();
  }

 private:
  static void append_header(Bytes& out, Time at) {
    OculusLogHeader header;
    header.created_unix_s = seconds(at.time_since_epoch());
    wire::append(out, header);
  }
  static void append_item(Bytes& out, std::uint16_t type, Time at, BytesView payload) {
    OculusLogItem item;
    item.type = type;
    item.at_unix_s = seconds(at.time_since_epoch());
    item.original_size = item.payload_size = static_cast<std::uint32_t>(payload.size());
    wire::append(out, item);
    out.insert(out.end(), payload.begin(), payload.end());
  }

  std::unique_ptr<Sink> sink_;
  bool begun_ = false;
};

}  // namespace

// Version 2 is an SQLite database, whose first letter is S; the error for it explains that.
Result<std::unique_ptr<RecordingReader>> read_oculus_log(std::unique_ptr<Source> source) {
  Scan scan(*source);
  const BytesView front = scan.read(file_header_bytes);
  const auto refuse = [&](const std::string& why) { return failure(ErrorKind::bad_data, source->name() + why); };
  if (!front.empty() && front[0] == std::byte{'S'})
    return refuse(" is an SQLite database: .oculus files of version 2 are not read, only version 1");
  if (front.size() < file_header_bytes) return refuse(" ends within its file header: it holds no message");
  const auto header = read_as<OculusLogHeader>(front);
  if (header.magic != OculusLogHeader{}.magic || header.size != file_header_bytes) return refuse(" is not an .oculus log file");
  if (header.version != 1)
    return refuse(": .oculus log files of version " + std::to_string(header.version) + " are not read, only version 1");
  if (header.encryption != 0) return refuse(" is encrypted: export it without encryption");
  return std::make_unique<LogReader>(std::move(source));
}

std::unique_ptr<RecordingWriter> write_oculus_log(std::unique_ptr<Sink> sink) {
  return std::make_unique<LogWriter>(std::move(sink));
}

}  // namespace sonar::recording
