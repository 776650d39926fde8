#include "protocol/doctor/check_status.hpp"

#include <algorithm>

#include "core/text/format.hpp"
#include "protocol/control/answers.hpp"

namespace sonar::doctor {
namespace {

/// True if the daemon has a note on the poses of the vehicle. The note replaces the finding that the poses are in order.
bool has_notes(const v1::DaemonStatus& status, const std::string& vehicle) {
  return std::any_of(status.notes().begin(), status.notes().end(),
                     [&vehicle](const v1::Note& note) { return note.vehicle() == vehicle; });
}

}  // namespace

std::string computing_text(double ms_per_ping) {
  const double hz = 1000 / ms_per_ping;
  return "computing takes " + text::format("%.0f", ms_per_ping) + " ms per ping: " + text::format("%.*f", hz < 10 ? 1 : 0, hz) +
         " Hz at most here";
}

void check_poses(const v1::DaemonStatus& status, std::vector<Finding>& findings) {
  for (const v1::VehicleStatus& v : status.vehicles()) {
    if (v.stale())
      findings.push_back({Level::warn, "poses", "poses of " + v.name() + " have stopped, the last came from " + v.source(),
                          "start the sender again, or choose poses.on_stale for the time without poses"});
    else if (!has_notes(status, v.name()))
      findings.push_back({Level::ok, "poses", "poses of " + v.name() + ": " + v.source(), ""});
  }
  for (const v1::Note& note : status.notes()) findings.push_back({Level::warn, "note", note.text(), note.cure()});
  if (status.poses().refused() > 0)
    findings.push_back({Level::warn, "poses",
                        std::to_string(status.poses().refused()) + " messages were refused as poses, " +
                            std::to_string(status.poses().accepted()) + " accepted",
                        "see sonard's log for the reason: not JSON, the frame, a quaternion's norm, a name, the clock"});
}

}  // namespace sonar::doctor
