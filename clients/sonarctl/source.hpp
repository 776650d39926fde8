// From a user's wish (address, discovery, recording, settings) to a device or to one decoded ping.
// Shared by the commands.
#pragma once

#include <chrono>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/ping_stream.hpp"

namespace sonar::clients {

std::chrono::milliseconds milliseconds_from(double s);

/// The address given, or the one a status broadcast names; `say` prints what was found.
Result<Endpoint> find_device(const SourceOptions& source, bool say);

/// Ping `number` of a recording, or the first of a device that was made with the settings asked for.
Result<oculus::DecodedPing> fetch_ping(const SourceOptions& source, std::size_t number);

}  // namespace sonar::clients
