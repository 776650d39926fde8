// Makes standard input, output and error usable, even if the daemon was started without them. main() calls it first.
#pragma once

namespace sonar {

/// Opens the null device for each of the descriptors 0 to 2 that is closed. Otherwise the next socket would get its number, and
/// log lines would get into a client's stream.
void open_closed_standard_streams();
/// Whether a write to standard error would block now, because a pipe is full or a terminal is stopped. Writes to a closed pipe do
/// not block; they are lost.
bool standard_error_is_blocked();

}  // namespace sonar
