// Recordings of a Water Linked Sonar 3D-15, .sonar: its datagrams back to back (docs/protocols/waterlinked.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

/// Each packet with the time that is in it. Packets of other kinds have the time of the one before; after damage the search goes
/// on for the next that is whole.
std::unique_ptr<RecordingReader> read_sonar_file(std::unique_ptr<Source> source);

}  // namespace sonar::recording
