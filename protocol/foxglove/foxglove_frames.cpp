#include "protocol/foxglove/foxglove_frames.hpp"

#include <algorithm>

namespace sonar::foxglove {
namespace {

// Opcodes, whose numbers have different meanings in the two directions.
constexpr std::uint8_t to_viewer_message = 1, to_viewer_time = 2, to_viewer_answer = 3, to_viewer_playback = 5;
constexpr std::uint8_t of_viewer_data = 1, of_viewer_call = 2, of_viewer_playback = 3;

std::uint64_t ns_of(Time at) { return static_cast<std::uint64_t>(at.time_since_epoch().count()); }

/// Writes a binary message field by field.
class Frame {
 public:
  explicit Frame(std::uint8_t opcode) { writer_("opcode", opcode); }
  Frame& add(auto value) {
    writer_("field", value);
    return *this;
  }
  Frame& text(const std::string& text) {
    std::transform(text.begin(), text.end(), std::back_inserter(bytes_), [](char c) { return static_cast<std::byte>(c); });
    return *this;
  }
  /// Adds a text, preceded by its length (u32).
  Frame& counted(const std::string& counted) { return add(static_cast<std::uint32_t>(counted.size())).text(counted); }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
  wire::Writer writer_{bytes_};
};

/// Encodes a call or its answer, which differ only in the opcode. The payload ends with the message, so its length is not stated.
Bytes service_frame(std::uint8_t opcode, const ServiceCall& call) {
  return Frame(opcode).add(call.service).add(call.call).counted(call.encoding).text(call.payload).take();
}

std::string text_of(BytesView bytes) {
  std::string text(bytes.size(), '\0');
  std::transform(bytes.begin(), bytes.end(), text.begin(), [](std::byte b) { return static_cast<char>(b); });
  return text;
}

std::string read_counted(wire::Reader& reader) {
  std::uint32_t count = 0;
  reader("length", count);
  return text_of(reader.block("text", count));
}

}  // namespace

Bytes message_head(std::uint32_t subscription, Time at) {
  return Frame(to_viewer_message).add(subscription).add(ns_of(at)).take();
}
Bytes time_frame(Time now) { return Frame(to_viewer_time).add(ns_of(now)).take(); }
Bytes service_answer(const ServiceCall& answer) { return service_frame(to_viewer_answer, answer); }

Bytes playback_frame(const PlaybackState& state) {
  const auto did_seek = static_cast<std::uint8_t>(state.did_seek);
  return Frame(to_viewer_playback)
      .add(state.status)
      .add(ns_of(state.at))
      .add(state.speed)
      .add(did_seek)
      .counted(state.request)
      .take();
}

Bytes encode(const ServiceCall& call) { return service_frame(of_viewer_call, call); }
Bytes encode(const PlaybackControl& control) {
  const auto command = static_cast<std::uint8_t>(control.pause), seeks = static_cast<std::uint8_t>(control.seeks);
  return Frame(of_viewer_playback)
      .add(command)
      .add(control.speed)
      .add(seeks)
      .add(ns_of(control.to))
      .counted(control.request)
      .take();
}

// The layouts are those of the specification. Further bytes are an error, except in a call, whose payload ends with the message.
Result<std::variant<ServiceCall, PlaybackControl>> frame_of_viewer(BytesView frame) {
  wire::Reader reader(frame);
  std::uint8_t opcode = 0;
  reader("opcode", opcode);
  std::variant<ServiceCall, PlaybackControl> read;
  if (opcode == of_viewer_call) {
    ServiceCall call;
    reader("service", call.service);
    reader("call", call.call);
    call.encoding = read_counted(reader);
    call.payload = text_of(reader.block("payload", reader.remaining()));
    read = std::move(call);
  } else if (opcode == of_viewer_playback) {
    PlaybackControl control;
    std::uint8_t command = 0, seeks = 0;
    std::uint64_t to = 0;
    reader("command", command);
    reader("speed", control.speed);
    reader("had_seek", seeks);
    reader("to", to);
    control.request = read_counted(reader);
    control.pause = command == 1;
    control.seeks = seeks == 1;
    control.to = Time(std::chrono::nanoseconds(static_cast<std::int64_t>(to)));
    const bool in_bounds = command <= 1 && seeks <= 1 && static_cast<std::int64_t>(to) >= 0;
    if (reader.ok() && (!in_bounds || reader.remaining() > 0))
      return failure(ErrorKind::bad_data, "a playback control with wrong fields");
    read = std::move(control);
  } else if (opcode == of_viewer_data && reader.ok()) {
    return failure(ErrorKind::bad_data, "sonard accepts no messages of viewers (clientPublish)");
  } else if (reader.ok()) {
    return failure(ErrorKind::bad_data, "binary message with opcode " + std::to_string(opcode) + ": unknown");
  }
  if (!reader.ok()) return failure(ErrorKind::bad_data, "binary message: " + reader.failure_text());
  return read;
}

}  // namespace sonar::foxglove
