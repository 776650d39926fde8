// Carries out requests for faults (add, end, list), the fault plan of the configuration, and MAVLink's failure injection.
#pragma once

#include "daemon/server/api/operations.hpp"
#include "daemon/server/faults/fault_log.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/system/log.hpp"
#include "protocol/mavlink/mavlink_poses.hpp"

namespace sonar {

namespace v1 {
class FaultStatus;
}
/// Returns the states of the faults of all sonars. `over_too`: include the last ended faults.
std::vector<v1::FaultStatus> fault_statuses(const Fleet& fleet, Time now, bool over_too);

class FaultOperations {
 public:
  FaultOperations(const Config& config, Fleet& fleet, const FaultLog& journal, const Clock& clock, Log& log)
      : config_(config), fleet_(fleet), journal_(journal), clock_(clock), log_(log) {}

  OperationResult add(const control::AddFault& asked, const Sender& sender);
  OperationResult end(const control::EndFaults& asked, const Sender& sender);
  OperationResult report(const control::GetFaults& asked) const;
  /// Executes MAVLink's command to inject a failure. The sonars of the configuration are the distance sensors 1, 2, ...; 0 = all.
  /// A failure replaces the previous one and ends after at most longest_manual_fault. Returns unsupported for another unit or a
  /// failure without effect; denied if faults are not armed, for an unknown sonar, or at a conflict with another fault.
  mavlink::MavResult inject(std::uint32_t unit, mavlink::FailureType type, std::uint32_t instance);
  /// Starts the fault plan of the configuration, which has been checked.
  void begin_plan(const Device* only = nullptr);  // null: on all sonars

 private:
  OperationResult add(const control::FaultRecord& record, bool manual, const Device* only = nullptr);

  const Config& config_;
  Fleet& fleet_;
  const FaultLog& journal_;
  const Clock& clock_;
  Log& log_;
};

}  // namespace sonar
