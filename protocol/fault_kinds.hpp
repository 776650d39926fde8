// The table of all kinds of faults: effect, parameters with limits and defaults, and the message field that a kind needs.
// Codes and names are stable, because users write them. Sources: public issue threads and measurements of open drivers.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "protocol/vendor.hpp"

namespace sonar::v1 {
class FaultKind;
class Trouble;
}  // namespace sonar::v1
namespace sonar {

/// The stage at which a fault acts; active faults act in this order.
enum class FaultStage { payload, device, time, framing, stream, link, clients, status, datagrams };
inline constexpr std::array<std::string_view, 9> fault_stage_names = {"payload", "device",  "time",   "framing",  "stream",
                                                                      "link",    "clients", "status", "datagrams"};

/// The effects of kinds; daemon/emulator/faults/ produces them.
enum class FaultEffect {
  // link and clients
  close_ports,
  end,
  withhold,
  withhold_pings,
  leave_waiting,
  refuse,
  take_over,
  power_cycle,
  flap,
  thin_link,
  delay,
  stop_reading,
  end_on_request,
  end_after,
  // shape of the stream
  slices,
  split_header,
  coalesce,
  burst,
  pause,
  // bytes of a message that carries a ping
  insert,
  insert_message,
  false_sync,
  set_field,
  add_to_field,
  cut_row,
  duplicate,
  drop,
  swap,
  flip,
  splice,
  header_only,
  join_late,
  bearings,
  renumber,
  // settings and state
  ignore_requests,
  delay_requests,
  clamp_requests,
  forget_settings,
  change_rate,
  change_settings,
  outbox_policy,
  beacon_field,
  heat,
  // status messages
  no_beacon,
  beacon_size,
  beacon_address,
  second_beacon,
  foreign_datagrams,
  // device clock
  clock_offset,
  clock_freeze,
  clock_drift,
  clock_restart,
  jitter,
  // samples
  stuck,
  blank,
  saturate,
  noise,
  dead_beams,
  spokes,
  gain_step,
  mirror,
  missing_rows,
  scale_range,
  intermittent,
  // datagrams of a ping
  lose_part,
  reorder_parts,
  repeat_part,
  lose_last_part,
  older_part,
  late_part,
  leave_group,
  // effects that the daemon cannot produce by itself
  harness,
};

struct FaultParameter {
  std::string_view name;
  std::string_view value;          // default
  double lowest = 0, highest = 0;  // limits of a number, inclusive
  std::string_view words = {};     // "a b c": the value is one of these words, not a number
  bool whole = false;              // the number has no fraction
};

struct FaultKind {
  std::string_view code, name;  // "L05", "silent-open"
  int tier = 1;
  FaultStage stage{};
  FaultEffect effect{};
  std::string_view sentence;     // the behaviour of the sonar
  std::string_view good_driver;  // the response of a correct driver
  double default_s = 0;          // default duration; 0 = per ping
  std::optional<protocol::FieldName> field = {};
  std::array<FaultParameter, 4> parameters = {};  // unused parameters have no name
  std::string_view touches = {};  // the changed part of a message or device; two faults that change the same part conflict

  /// True if the fault acts on single pings, false if it acts for a time.
  bool per_ping() const { return default_s == 0; }
  std::span<const FaultParameter> given() const;
};

std::span<const FaultKind> fault_kinds();
/// Finds a kind by code or name, ignoring case; null if there is none.
const FaultKind* find_fault_kind(std::string_view code_or_name);

/// A trouble: several kinds under a common name. `severity` (1 to 3) selects the parameters.
struct Trouble {
  struct Part {
    std::string_view code;
    std::array<std::string_view, 3> with;  // for each severity: "seconds=0.5 bytes=16"
    double after = 0;                      // the part begins after this fraction of the trouble's duration
  };
  std::string_view name, sentence;
  double default_s = 10;
  std::array<Part, 4> parts = {};  // unused parts have no code
};
std::span<const Trouble> troubles();

// Fills messages with the table of faults, for reports of the daemon and for sonarctl if no daemon runs.

/// Fills all fields except `without_effect`.
void fill(v1::FaultKind& out, const FaultKind& kind);
/// Fills the name, the sentence and the codes.
void fill(v1::Trouble& out, const Trouble& trouble);

}  // namespace sonar
