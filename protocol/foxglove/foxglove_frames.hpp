// The binary messages of the Foxglove WebSocket protocol, little-endian; the first byte is the opcode. The specification is in
// the history of https://github.com/foxglove/ws-protocol (the commit before 8e2a044).
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "core/base/result.hpp"
#include "core/base/units.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::foxglove {

using wire::Bytes;
using wire::BytesView;

/// Returns the head of a channel's message, which precedes the payload.
Bytes message_head(std::uint32_t subscription, Time at);
Bytes time_frame(Time now);

/// A call of a service, or its answer, which has the same fields. `payload` is in `encoding`.
struct ServiceCall {
  std::uint32_t service = 0, call = 0;
  std::string encoding;
  std::string payload;
};
Bytes service_answer(const ServiceCall& answer);

enum class PlaybackStatus : std::uint8_t { playing, paused, buffering, ended };
struct PlaybackState {
  PlaybackStatus status{};
  Time at{};
  float speed = 1;
  bool did_seek = false;
  std::string request;  // id of the request; empty = the state is not an answer
};
Bytes playback_frame(const PlaybackState& state);

struct PlaybackControl {
  bool pause = false;
  float speed = 1;
  bool seeks = false;
  Time to{};  // target of a seek
  std::string request;
};
/// Reads a frame that a viewer sent. Errors: bad_data if the frame is too short, has wrong lengths or fields, or is neither a
/// call nor a playback control.
Result<std::variant<ServiceCall, PlaybackControl>> frame_of_viewer(BytesView frame);

/// Returns the bytes of a call or a playback control that a viewer would send; for tests and clients.
Bytes encode(const ServiceCall& call);
Bytes encode(const PlaybackControl& control);

}  // namespace sonar::foxglove
