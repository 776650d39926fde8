// From a user's wish (address, discovery, recording, settings) to a device or to one decoded ping.
// Shared by the commands.
#pragma once

#include <chrono>

#include "clients/sonarctl/commands.hpp"

namespace sonar::clients {

std::chrono::milliseconds milliseconds_from(double s);

/// The address given, or the one a status broadcast names; `say` prints what was found.
Result<Endpoint> find_device(const SourceOptions& source, bool say);

/// `what` did not come within source.silence_limit_s, or, when not one Oculus message ever came (`heard`), that it did not.
Error silence(const SourceOptions& source, const Endpoint& device, bool heard, const std::string& what, const std::string& hint);

/// A connection to the device with the settings asked for.
Result<PingStream> open_stream(const SourceOptions& source, const Endpoint& device);

/// Ping `number` of a recording, or the first of a device that was made with the settings asked for.
Result<AnyPing> fetch_ping(const SourceOptions& source, std::size_t number);

}  // namespace sonar::clients
