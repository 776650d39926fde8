// Carries out the commands of clients, except trigger_ping, which is part of the session.
#pragma once

#include <nlohmann/json.hpp>

#include "protocol/dvl/settings.hpp"

namespace sonar::dvl {

using Json = nlohmann::ordered_json;

/// An outcome without an error is a success.
struct Outcome {
  Json result = nullptr;
  std::string error = {};
};
/// Carries out a command; commands that set values change `settings`. nullopt: there is no such command.
std::optional<Outcome> carry_out(const std::string& command, const Json& parameters, const protocol::DeviceState& device,
                                 Time now, Settings& settings);
/// The answer to get_version_info. The version names sonard, so that a log shows that the device was emulated.
Json version_info(const protocol::DeviceState& device);
protocol::Bytes response_line(const std::string& to, const Outcome& outcome);

}  // namespace sonar::dvl
