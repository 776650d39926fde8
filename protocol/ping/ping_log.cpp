#include "protocol/ping/ping_log.hpp"

#include <optional>
#include <string>
#include <utility>

#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/s500_messages.hpp"

namespace sonar::recording {
namespace {

ping::Id first_id(BytesView message) {
  ping::Header header;
  wire::Reader reader(message);
  fields(reader, header);
  return header.id;
}
/// Returns whether the message answers a host. Such answers may come before the pings and do not identify the product.
bool is_answer(ping::Id id) {
  using enum ping::Id;
  return ping::is_of_device(id) || id == device_information || id == protocol_version;
}

/// Returns the product's name in a log. unknown: the maker's name of an S500.
const char* product_of(ping::Id first) {
  switch (first) {
    case ping::Id::os_mono_profile:
      return "os450";
    case ping::Id::s500_distance2:
    case ping::Id::s500_profile6:
      return "s500";
    default:
      return "mbes24016";
  }
}

/// Returns the JSON text with which the maker's programs begin a log, without the parts that describe a computer.
std::string beginning(ping::Id first) {
  return std::string(R"({"session_id":1,"session_uptime":0.0,"session_devices":[{"product_id":")") + product_of(first) +
         R"("}],"is_recording":true})";
}

/// Returns the time since power-up in a message of a Surveyor, an Omniscan or an S500; nullopt for other messages.
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
    case ping::Id::s500_distance2:
      return of(ping::Distance2{});
    case ping::Id::s500_profile6:
      return of(ping::Profile6{});
    default:
      return std::nullopt;
  }
}

constexpr std::size_t chunk_bytes = std::size_t{64} << 10;

/// Reads frame by frame. Bytes between frames are noted as damage.
class PingLogReader final : public RecordingReader {
 public:
  explicit PingLogReader(std::unique_ptr<Source> source) : source_(std::move(source)), scan_(*source_) {}

  /// Returns the next frame. Frames without a time get the time of the previous frame. The JSON text at the start is not a
  /// message of the device, and is left out.
  std::optional<RecordedMessage> next() override {
    while (const auto frame = next_frame()) {
      const BytesView bytes = framer_.bytes();
      note_what_is_skipped(framer_.passed() - bytes.size());
      whole_to_ = framer_.passed();
      if (const auto ms = power_up_ms(*frame)) at_ = Time(std::chrono::milliseconds(*ms));
      if (frame->header.id != ping::Id::json_wrapper)
        return RecordedMessage{at_, Origin::device, Carrier::stream, Bytes(bytes.begin(), bytes.end())};
    }
    note_what_is_skipped(scan_.position());
    if (scan_.left() > 0) damages_.add("cannot be read from byte " + std::to_string(scan_.position()) + " on");
    return std::nullopt;
  }
  std::optional<Error> damage() const override { return damages_.error(source_->name()); }
  void rewind() override {
    scan_.seek(0);
    framer_ = ping::Framer(ping::longest_payload);
    whole_to_ = 0;
    at_ = {};
    damages_.clear();
  }

 private:
  /// Returns the next frame with a correct checksum.
  std::optional<ping::Frame> next_frame() {
    for (bool ended = false;;) {
      while (auto frame = framer_.next())
        if (frame->sum_is_right) return frame;
      if (ended) return std::nullopt;
      const BytesView more = scan_.read(chunk_bytes);
      framer_.append(more);
      ended = more.empty();
      if (ended) framer_.end();
    }
  }
  void note_what_is_skipped(std::uint64_t to) {
    if (to > whole_to_)
      damages_.add("bytes " + std::to_string(whole_to_) + " to " + std::to_string(to - 1) + " are not a whole frame");
    whole_to_ = to;
  }

  std::unique_ptr<Source> source_;
  Scan scan_;
  ping::Framer framer_{ping::longest_payload};
  std::uint64_t whole_to_ = 0;  // offset of the end of the last frame
  Time at_{};
  Damages damages_;
};

/// Writes a JSON text, which is made when the first message identifies the product, and then the frames of the device.
class PingLogWriter final : public RecordingWriter {
 public:
  explicit PingLogWriter(std::unique_ptr<Sink> sink) : sink_(std::move(sink)) {}

  Result<void> write(const RecordedMessage& message) override {
    if (message.from != Origin::device || message.by != Carrier::stream) return {};
    Bytes record;
    if (!begun_) {  // the first message identifies the product
      if (is_answer(first_id(message.bytes))) return {};
      const std::string text = beginning(first_id(message.bytes));
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
