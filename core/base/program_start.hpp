// The first and last steps of main(). The functions make the standard streams usable even if a program was started without them,
// and detect lost output.
#pragma once

#include <cstddef>

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

// Makes room for the stacks of a program, because a program whose stack reaches its limit ends without a message.

constexpr std::size_t usual_stack_bytes = std::size_t{8} << 20;  // the usual limit of systems

/// Raises the limit of the main thread's stack to the usual size, as far as the hard limit permits. New threads also get the
/// usual size if theirs is below 1 MiB. Call it before threads start. Error: unavailable if the hard limit is too low.
Result<void> make_room_for_stacks();

}  // namespace sonar
