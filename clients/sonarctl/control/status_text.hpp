// Converts status, events and faults of a daemon to text, and the arguments of `fault add` to a record. It does no I/O.
#pragma once

#include <string>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/result.hpp"
#include "protocol/control/operations.hpp"

namespace sonar::v1 {  // from control.pb.h
class DaemonStatus;
class Event;
class FaultEntry;
class FaultReport;
class ObjectStatus;
}  // namespace sonar::v1

namespace sonar::clients {

/// Returns several lines, each with its newline.
std::string text_from(const v1::DaemonStatus& status);
/// Returns one line without newline.
std::string text_from(const v1::ObjectStatus& object);
std::string text_from(const v1::Event& event);
/// Returns "-6.00 0.00 -3.00 m, heading 90.0, bow-up pitch -15.0, roll 0.0 deg": east, north, up; compass; starboard down.
std::string place_text(const Pose& body_in_world);

/// Returns one line without newline.
std::string text_from(const v1::FaultEntry& entry);
/// Returns several lines, each with its newline.
std::string fault_list_text(const v1::FaultReport& report);
std::string fault_kinds_text(const v1::FaultReport& report);
/// Returns the table of kinds by vendors in Markdown. The report must have kinds.
std::string fault_support_text(const v1::FaultReport& report);

/// Parses {"bytes=1", "fill=zero"}. Errors: usage.
Result<void> read_parameters(const std::vector<std::string>& given, control::FaultRecord& record);
/// Parses {"every=50", "phase=3"}; the daemon checks the numbers. Errors: usage.
Result<void> read_trigger(const std::vector<std::string>& given, control::FaultRecord& record);

}  // namespace sonar::clients
