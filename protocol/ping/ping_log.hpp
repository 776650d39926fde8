// Logs of Cerulean's products (.svlog): successive frames of the ping protocol. The first has a JSON text that describes the
// log (docs/recording.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

/// Reads each frame, except the JSON text, as a message of the stream. Times count from the device's power-up.
std::unique_ptr<RecordingReader> read_ping_log(std::unique_ptr<Source> source);
/// Accepts messages that a Surveyor, an Omniscan or an S500 sends over TCP; ignores others.
std::unique_ptr<RecordingWriter> write_ping_log(std::unique_ptr<Sink> sink);

}  // namespace sonar::recording
