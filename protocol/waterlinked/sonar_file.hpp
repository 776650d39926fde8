// Recordings of a Water Linked Sonar 3D-15 (.sonar): the successive datagrams of the sonar (docs/protocols/waterlinked.md).
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

/// Reads each packet with the time that it states; packets without a time get that of the previous packet. After damage it
/// searches for the next whole packet.
std::unique_ptr<RecordingReader> read_sonar_file(std::unique_ptr<Source> source);

}  // namespace sonar::recording
