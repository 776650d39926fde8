// From a user's wish (address, discovery, recording, settings) to a device or to one decoded ping.
// Shared by the commands.
#pragma once

#include <chrono>

#include "clients/sonarctl/commands.hpp"

namespace sonar::clients {

std::chrono::milliseconds milliseconds_from(double s);

/// The address given, or the one a status broadcast names; `say` prints what was found.
Result<Endpoint> find_device(const SourceOptions& source, bool say);

/// A device's pings: as one more client, with the settings asked for, or as an observer.
struct OpenedStream {
  PingStream stream;
  std::chrono::steady_clock::time_point connected_at;
  bool observes = false;  // nothing was asked: pings come as the sonar's clients asked for them
};
/// As an observer when source.observe, or when the sonar has no place for a client and its sonard says where observers connect;
/// standard error then says so.
Result<OpenedStream> open_stream(const SourceOptions& source, const Endpoint& device);

/// `what` did not come within source.silence_limit_s, or, when not one Oculus message ever came (`heard`), that it did not.
Error silence(const SourceOptions& source, const Endpoint& device, bool heard, const std::string& what, const std::string& hint);

/// Ping `number` of a recording, or the first of a device that was made with the settings asked for.
Result<AnyPing> fetch_ping(const SourceOptions& source, std::size_t number);

}  // namespace sonar::clients
