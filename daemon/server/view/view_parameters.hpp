// Parameters of the Foxglove protocol, with which viewers read and set values of a running daemon. A write becomes an operation,
// like a request over HTTP. docs/live-view.md lists the names.
#pragma once

#include <optional>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/sonars/device.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/clock.hpp"
#include "protocol/control/operations.hpp"
#include "protocol/foxglove/foxglove_words.hpp"

namespace sonar {

// Encodes messages of control.proto for viewers.

namespace v1 {  // from control.pb.h
class DaemonStatus;
class FaultReport;
}  // namespace v1

ViewPayloadPointer ping_payload(const Device& of, const PingQueued& queued);
/// Returns the figures of a ping for plots, in CDR.
ViewPayloadPointer figures_payload(const Device& of, const PingQueued& queued);
ViewPayloadPointer status_payload(Time now, const v1::DaemonStatus& status);
ViewPayloadPointer faults_payload(Time now, const v1::FaultReport& report);

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
