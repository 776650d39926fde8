// Recordings of ARIS sonars (.aris): a file header, then header and picture of each frame; each header has 1024 bytes. All
// frames have the same numbers of beams and samples, as the format requires (docs/protocols/aris.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

/// Reads each frame as the datagrams that a sonar would send, numbered from 1, with the recorded header and picture. Errors:
/// bad_data if the file does not begin with a valid header.
Result<std::unique_ptr<RecordingReader>> read_aris_file(std::unique_ptr<Source> source);
/// Accepts the datagrams of frames and writes complete frames; other messages are ignored. Errors: bad_data if a frame has
/// another size than the first, because the settings have changed.
std::unique_ptr<RecordingWriter> write_aris_file(std::unique_ptr<Sink> sink);

}  // namespace sonar::recording
