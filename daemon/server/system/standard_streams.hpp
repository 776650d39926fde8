// Standard input, output and error made usable for the daemon, even if it was started without them. Called first in main().
#pragma once

namespace sonar {

/// Opens the null device for each of the descriptors 0 to 2 that is closed: else the next socket would get its number, and log
/// lines would end in a client's stream.
void open_closed_standard_streams();
/// Standard error is blocked at the moment: a full pipe, a stopped terminal. A closed pipe takes, and loses.
bool standard_error_is_blocked();

}  // namespace sonar
