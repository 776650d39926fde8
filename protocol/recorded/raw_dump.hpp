// The plain byte stream of a device, without times: messages back to back (docs/recording.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/message_splitter.hpp"

namespace sonar::recording {

/// bad_data when the source does not begin with a message of this kind. `framing` must outlive the reader.
Result<std::unique_ptr<RecordingReader>> read_raw_dump(std::unique_ptr<Source> source, const Framing& framing);
/// Keeps only the bytes that the device sent, of pings, by TCP or as datagrams.
std::unique_ptr<RecordingWriter> write_raw_dump(std::unique_ptr<Sink> sink, Carrier by = Carrier::stream);

}  // namespace sonar::recording
