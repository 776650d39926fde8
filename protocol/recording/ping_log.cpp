#include "protocol/recording/ping_log.hpp"

#include <optional>
#include <string>
#include <utility>

#include "protocol/ping/omniscan_messages.hpp"

namespace sonar::recording {
namespace {

/// As the makers' own programs begin a log, without what they say of their computer.
std::string beginning(BytesView message) {
  ping::Header header;
  wire::Reader reader(message);
  fields(reader, header);
  return std::string(R"({"session_id":1,"session_uptime":0.0,"session_devices":[{"product_id":")") +
         (header.id == ping::Id::os_mono_profile ? "os450" : "mbes24016") + R"("}],"is_recording":true})";
}

/// Milliseconds since power-up, of the messages that tell them.
std::optional<std::uint32_t> power_up_ms(const ping::Frame& frame) {
  const auto of = [&](auto message) -> std::optional<std::uint32_t> {
    wire::Reader reader(frame.payload);
    fields(reader, message);
    return reader.ok() ? std::optional(message.power_up_ms) : std::nullopt;
  };
  switch (frame.header.id) {
    case ping::Id::attitude_report:
      return of(ping::AttitudeReport{});
    case ping::Id::atof_point_data:
      return of(ping::AtofPointData{});
    case ping::Id::yz_point_data:
      return of(ping::YzPointData{});
    case ping::Id::os_mono_profile:
      return of(ping::OsMonoProfile{});
    default:
      return std::nullopt;
  }
}

class PingLogReader final : public RecordingReader {
 public:
  explicit PingLogReader(std::unique_ptr<Source> source) : source_(std::move(source)), scan_(*source_) {}

  std::optional<RecordedMessage> next() override {
    while (!scan_.peek(1).empty()) {
      const auto frame = frame_here();
      if (!frame) {
        scan_.skip(1);
        continue;
      }
      note_what_is_skipped();
      const std::size_t size = ping::header_size + frame->payload.size() + ping::sum_size;
      const BytesView bytes = scan_.read(size);
      if (const auto ms = power_up_ms(*frame)) at_ = Time(std::chrono::milliseconds(*ms));
      whole_to_ = scan_.position();
      if (frame->header.id != ping::Id::json_wrapper)
        return RecordedMessage{at_, Origin::device, Carrier::stream, Bytes(bytes.begin(), bytes.end())};
    }
    note_what_is_skipped();
    return std::nullopt;
  }
  std::optional<Error> damage() const override { return damages_.error(source_->name()); }
  void rewind() override {
    scan_.seek(0);
    whole_to_ = 0;
    at_ = {};
    damages_.clear();
  }

 private:
  void note_what_is_skipped() {
    const std::uint64_t here = scan_.position();
    if (here > whole_to_)
      damages_.add("bytes " + std::to_string(whole_to_) + " to " + std::to_string(here - 1) + " are no whole frame");
    whole_to_ = here;
    if (scan_.left() > 0 && scan_.peek(1).empty()) damages_.add("cannot be read from byte " + std::to_string(here) + " on");
  }
  /// With the right sum, without moving.
  std::optional<ping::Frame> frame_here() {
    ping::Header header;
    wire::Reader reader(scan_.peek(ping::header_size));
    fields(reader, header);
    if (!reader.ok() || header.start != ping::Header{}.start) return std::nullopt;
    ping::Framer framer(header.length);
    framer.append(scan_.peek(ping::header_size + header.length + ping::sum_size));
    auto frame = framer.next();
    return frame && frame->sum_is_right ? std::move(frame) : std::nullopt;
  }

  std::unique_ptr<Source> source_;
  Scan scan_;
  std::uint64_t whole_to_ = 0;  // where the last frame ends
  Time at_{};
  Damages damages_;
};

class PingLogWriter final : public RecordingWriter {
 public:
  explicit PingLogWriter(std::unique_ptr<Sink> sink) : sink_(std::move(sink)) {}

  Result<void> write(const RecordedMessage& message) override {
    if (message.from != Origin::device || message.by != Carrier::stream) return {};
    Bytes record;
    if (!begun_) {
      const std::string text = beginning(message.bytes);
      record = ping::framed(ping::Id::json_wrapper, 0, std::as_bytes(std::span(text)));
    }
    record.insert(record.end(), message.bytes.begin(), message.bytes.end());
    auto written = sink_->append(record);
    begun_ |= written.has_value();
    return written;
  }
  Result<void> close() override { return sink_->close(); }

 private:
  std::unique_ptr<Sink> sink_;
  bool begun_ = false;
};

}  // namespace

std::unique_ptr<RecordingReader> read_ping_log(std::unique_ptr<Source> source) {
  return std::make_unique<PingLogReader>(std::move(source));
}

std::unique_ptr<RecordingWriter> write_ping_log(std::unique_ptr<Sink> sink) {
  return std::make_unique<PingLogWriter>(std::move(sink));
}

}  // namespace sonar::recording
