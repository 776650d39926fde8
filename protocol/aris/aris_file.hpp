// Recordings of ARIS sonars, .aris: a file header, then header and picture of each frame, headers 1024 bytes each. All frames
// have as many beams and samples as the first, as the format requires (docs/protocols/aris.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

/// Each frame as the datagrams that a sonar sends, numbered from 1: the recorded header and picture. bad_data when the file does
/// not begin with a header that frames can have.
Result<std::unique_ptr<RecordingReader>> read_aris_file(std::unique_ptr<Source> source);
/// Takes the datagrams of frames and keeps whole ones; other messages are left out. bad_data: a frame of another shape, since the
/// settings have changed.
std::unique_ptr<RecordingWriter> write_aris_file(std::unique_ptr<Sink> sink);

}  // namespace sonar::recording
