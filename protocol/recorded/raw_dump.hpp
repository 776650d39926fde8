// The plain byte stream of a device: successive messages without times (docs/recording.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/message_splitter.hpp"

namespace sonar::recording {

/// Reads a raw dump. Errors: bad_data if the source does not begin with a message of this framing. `framing` must outlive the
/// reader.
Result<std::unique_ptr<RecordingReader>> read_raw_dump(std::unique_ptr<Source> source, const Framing& framing);
/// Writes all bytes that the device sent with the carrier `by`, and nothing else.
std::unique_ptr<RecordingWriter> write_raw_dump(std::unique_ptr<Sink> sink, Carrier by = Carrier::stream);

}  // namespace sonar::recording
