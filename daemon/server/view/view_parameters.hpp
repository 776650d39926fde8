// Parameters of the Foxglove protocol, with which viewers read and set values of a running daemon. A write becomes an operation,
// like a request over HTTP. docs/live-view.md lists the names.
#pragma once

#include <optional>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/clock.hpp"
#include "protocol/control/operations.hpp"
#include "protocol/foxglove/foxglove_words.hpp"

namespace sonar {

struct ParameterSource {
  const Config& config;
  const Clock& clock;
  const World& world;
  const Fleet& fleet;
};

/// Returns the number of a parameter; nullopt if it is not a finite number.
std::optional<double> number_of(const foxglove::Value& value);
/// Returns all parameters; parameters without a value are unset.
std::vector<foxglove::Parameter> parameters_of(const ParameterSource& of);
/// Returns the operation that a write requests, or an error of kind usage.
Result<control::Operation> operation_of(const foxglove::Parameter& wanted, const ParameterSource& of);

}  // namespace sonar
