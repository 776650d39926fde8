// Standard input, output and error of the programs: usable even if a program was started without them, and checked for losses.
#pragma once

#include "core/base/result.hpp"

namespace sonar {

/// Opens the null device for each of the descriptors 0 to 2 that is closed. Otherwise the next socket would get its number, and
/// lines of text would get into a stream. main() calls it first.
void open_closed_standard_streams();
/// Returns whether a write to standard error would block now, because a pipe is full or a terminal is stopped. Writes to a closed
/// pipe do not block; they are lost.
bool standard_error_is_blocked();
/// Writes what is buffered for standard output. Error io: something that was printed is lost, for example because the disk is
/// full. A reader that has closed its end (`| head`) has received all that it reads, which is not an error.
Result<void> flush_standard_output();

}  // namespace sonar
