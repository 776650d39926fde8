// Converts a daemon's faults to text, and the arguments of `fault add` to a record. No I/O.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "protocol/control/fault_record.hpp"

namespace sonar::v1 {  // from control.pb.h
class FaultEntry;
class FaultReport;
}  // namespace sonar::v1

namespace sonar::clients {

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
