// Logs of Cerulean's products, .svlog: frames of the ping protocol back to back, the first a JSON text that says what follows
// (docs/protocols/ping.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

/// Each frame as a message of the stream, but the JSON text. Times are those since the device's power-up.
std::unique_ptr<RecordingReader> read_ping_log(std::unique_ptr<Source> source);
/// Takes what a Surveyor, an Omniscan or an S500 sends over TCP; other messages are left out.
std::unique_ptr<RecordingWriter> write_ping_log(std::unique_ptr<Sink> sink);

}  // namespace sonar::recording
