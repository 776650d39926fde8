// Faults of a daemon as text, and the arguments of `fault add` as a record. This has no I/O; the commands fault and events print
// it.
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

/// One line without newline.
std::string text_from(const v1::FaultEntry& entry);
/// Several lines, each with its newline.
std::string fault_list_text(const v1::FaultReport& report);
std::string fault_kinds_text(const v1::FaultReport& report);
/// The table kind x vendor in Markdown, of a report with kinds.
std::string fault_support_text(const v1::FaultReport& report);

/// {"bytes=1", "fill=zero"}. Errors: usage.
Result<void> read_parameters(const std::vector<std::string>& given, control::FaultRecord& record);
/// {"every=50", "phase=3"}. The daemon checks the numbers. Errors: usage.
Result<void> read_trigger(const std::vector<std::string>& given, control::FaultRecord& record);

}  // namespace sonar::clients
