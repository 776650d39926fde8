// Encodes messages of control.proto for viewers.
#pragma once

#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/sonars/device.hpp"

namespace sonar {

namespace v1 {  // from control.pb.h
class DaemonStatus;
class FaultReport;
}  // namespace v1

ViewPayloadPointer ping_payload(const Device& of, const PingQueued& queued);
/// Returns the figures of a ping for plots, in CDR.
ViewPayloadPointer figures_payload(const Device& of, const PingQueued& queued);
ViewPayloadPointer status_payload(Time now, const v1::DaemonStatus& status);
ViewPayloadPointer faults_payload(Time now, const v1::FaultReport& report);

}  // namespace sonar
