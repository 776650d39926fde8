// The plain byte stream of a device, without times: messages back to back (docs/recording.md, "Raw dumps").
#pragma once

#include <memory>

#include "protocol/recording/message_splitter.hpp"
#include "protocol/recording/store.hpp"

namespace sonar::recording {

/// bad_data when the source does not begin with an Oculus message.
Result<std::unique_ptr<PieceReader>> read_raw_dump(std::unique_ptr<Source> source);
/// Keeps what the device sent by TCP, and nothing else.
std::unique_ptr<PieceWriter> write_raw_dump(std::unique_ptr<Sink> sink);

}  // namespace sonar::recording
