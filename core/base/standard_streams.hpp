// Standard input, output and error of the programs. The functions make the streams usable even if a program was started without
// them, and detect lost output.
#pragma once

#include "core/base/result.hpp"

namespace sonar {

/// Opens the null device for each of the descriptors 0 to 2 that is closed. Otherwise the next socket would get that number,
/// and printed text would go to the socket. main() must call this function first.
void open_closed_standard_streams();
/// True if a write to standard error would block now, because a pipe is full or a terminal is stopped. Writes to a closed pipe
/// do not block; their text is lost.
bool standard_error_is_blocked();
/// Writes the buffer of standard output. Error io: printed text was lost, for example because the disk is full. A closed
/// reading end (`| head`) is not an error.
Result<void> flush_standard_output();

}  // namespace sonar
