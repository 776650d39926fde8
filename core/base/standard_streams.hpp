// Standard input, output and error of the programs: makes them usable even if a program was started without them, and detects
// lost output.
#pragma once

#include "core/base/result.hpp"

namespace sonar {

/// Opens the null device for each of the descriptors 0 to 2 that is closed. Otherwise the next socket would get that number,
/// and printed text would go to the socket. main() calls it first.
void open_closed_standard_streams();
/// Returns whether a write to standard error would block now, because a pipe is full or a terminal is stopped. Writes to a closed
/// pipe do not block; they are lost.
bool standard_error_is_blocked();
/// Writes the buffer of standard output. Error io: printed text was lost, for example because the disk is full. It is not an
/// error if the reader has closed its end (`| head`).
Result<void> flush_standard_output();

}  // namespace sonar
