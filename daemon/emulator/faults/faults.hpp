// The faults of one emulated sonar. The Sonar calls this object wherever a fault may act. It has no sockets and no clock:
// effects on ports and connections are returned as orders. Random numbers depend only on (seed, fault, sonar, ping, client), so
// the same plan of faults gives the same bytes.
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/sonar/ping.hpp"
#include "daemon/config/faults/fault.hpp"
#include "daemon/emulator/connections/connections.hpp"
#include "daemon/emulator/faults/journal.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

/// Immediate effects of a fault on the sonar.
struct SetListening {
  bool on = true;
};
struct EndClients {
  bool reset = false;
  std::optional<ConnectionId> only = {};
};
struct ForgetSettings {};
struct RestartDevice {
  bool clock_only = false;
};
struct OverrideSettings {
  protocol::SettingsOverride wanted;
};
struct ApplyRequest {  // applies a delayed request of a client
  protocol::ChangeSettings change;
  std::string who;
};
struct ChangePace {};  // rate_factor() has changed
struct ReadClients {
  bool on = true;
};
struct DropNewestPings {  // outboxes of slow clients drop the newest pings
  bool on = true;
};
struct ReleaseHeld {};
struct StopShaping {};  // ends the shaping of the current message
struct ServeWaiting {};
using FaultOrder = std::variant<SetListening, EndClients, ForgetSettings, RestartDevice, OverrideSettings, ApplyRequest,
                                ChangePace, ReadClients, DropNewestPings, ReleaseHeld, StopShaping, ServeWaiting>;

/// The reason why a sonar cannot have faults.
struct FaultRefusal {
  /// no_effect: the faults cannot change anything on this product (another sonar may accept them). conflict: a present fault
  /// excludes them.
  enum class Code { no_effect, conflict } code = Code::conflict;
  std::string text;  // a sentence
};

class Faults {
 public:
  /// The references must outlive the object. `index` and `seed` are part of the key of random numbers.
  struct Around {
    const protocol::Vendor& vendor;
    const Connections& connections;
    const std::string& sonar;
    std::uint32_t index = 0;
    Seed seed{};
    FaultJournal* journal = nullptr;
  };
  Faults(Around around, Time now) : around_(around), start_(now) {}

  // ---- the list of faults
  /// Returns the reason why this sonar cannot have these faults; nullopt if it can.
  std::optional<FaultRefusal> why_not(const std::vector<Fault>& faults) const;
  /// Adds those of `faults` that are for this sonar and have an effect on it. `manual`: a user requested the faults, so they end
  /// after longest_manual_fault.
  void add(const std::vector<Fault>& faults, bool manual, Time now, Actions& actions);
  /// Ends the faults with this name, or all if `name` is empty. Returns false if there is none.
  bool end(const std::string& name, Time now, Actions& actions);
  struct Listed {
    const Fault* fault;
    bool active, over;
    std::uint64_t injections;
    Time expires;  // Time::max() = no time limit
  };
  std::vector<Listed> list() const;
  std::size_t active_count() const;
  std::vector<FaultOrder> take_orders() { return std::exchange(orders_, {}); }

  // ---- time
  void on_tick(Time now);
  std::optional<Time> next_tick() const;
  void on(Occasion occasion, Time now);

  // ---- pings
  /// Call it before a ping is framed: begins faults that the ping triggers, and decides which faults act on it.
  void begin_ping(std::uint32_t number, Time now);
  /// Returns the ping as the device reports it, with changed samples or stamps.
  std::shared_ptr<const Ping> altered(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state, Time now);
  /// True if alter_datagrams() may change the datagrams of this ping, so that they must be copied.
  bool alters_datagrams(const Connection& stream, std::uint32_t ping) const;
  void alter_datagrams(std::vector<protocol::Bytes>& datagrams, const Connection& stream, std::uint32_t ping, Time now);
  bool leaves_group() const;
  /// Changes a message before it is sent to a client. Returns false if it must not be sent.
  bool shape(const Connection& to, Outbox::Message& message, Time now);
  /// States whether a ping is held back before it enters a client's outbox, and until which time or for how many pings.
  struct Hold {
    enum class Kind { pass, until, after_next, collect } kind = Kind::pass;
    Time until{};
    std::size_t collect = 0;
  };
  Hold hold(const Connection& to, std::uint32_t ping, Time now);
  /// True if the sonar sends this ping to no client, because a fault withholds or drops it, or the device is off. Faults of links
  /// and of single clients are ignored.
  bool withholds(std::uint32_t ping, Time now) const;
  /// Returns the factor by which faults multiply the ping rate; 0 = no pings.
  double rate_factor() const;

  // ---- clients
  enum class Admission { as_configured, wait, take_over, refuse, reset };
  Admission admission() const;
  void on_served(const Connection& client, Time now);
  enum class RequestVerdict { apply, ignore, end, reset };
  /// Call it when a client requests settings. A fault may limit `change`. If the verdict is `ignore`, the sonar must not apply
  /// the change now; a delayed change follows as an order.
  RequestVerdict on_request(protocol::ChangeSettings& change, const std::string& who, const protocol::DeviceState& state,
                            Time now);
  /// Call it when a client has sent any bytes.
  RequestVerdict on_bytes(const std::string& who, Time now);

  // ---- status messages
  void alter_beacons(std::vector<protocol::Bytes>& beacons, Time now);

 private:
  struct Entry {
    Fault fault;
    bool manual = false;
    std::uint32_t key = 0;
    bool active = false, over = false;
    std::uint64_t begun = 0, injections = 0, pings_left = 0;
    std::optional<Time> begins;  // set while the fault's delay passes
    Time expires = Time::max(), since{}, until = Time::max(), step = Time::max();
    bool down = false;               // state of a port or link that alternates
    std::deque<std::uint32_t> hits;  // the latest pings on which the fault acts
    std::optional<std::uint32_t> first_number;
    std::shared_ptr<const Ping> kept;
    std::optional<Time> kept_time;
    protocol::Bytes before;  // previous message (splice), or part of an earlier ping (older_part, late_part)
    std::vector<std::pair<Time, ConnectionId>> ends;  // times at which end_after ends connections
    std::vector<std::pair<Time, ApplyRequest>> late;  // requests that delay_requests holds back
  };
  using Effect = FaultEffect;

  bool is_for_this(const Fault& fault) const { return fault.sonar.empty() || fault.sonar == around_.sonar; }
  void add(Fault fault, bool manual, Time now);
  bool any(Effect effect) const;
  Entry* active(Effect effect);
  const Entry* active(Effect effect) const { return const_cast<Faults*>(this)->active(effect); }
  bool met(const Entry& entry, std::uint32_t ping) const;
  bool frames_datagrams(const Connection& stream) const;
  bool chosen(const Fault& fault, const Connection& client) const;
  bool fires(const Entry& entry, std::uint32_t ping) const;
  void begin(Entry& entry, Time now);
  void begin_effect(Entry& entry, Time now);
  void end(Entry& entry, Time now);
  void end_effect(Entry& entry);
  void finish(Entry& entry, Time now);
  void forget_old();
  void step(Entry& entry, Time now);
  void count_ping(Entry& entry, Time now);
  void note(Entry& entry, FaultEntry::What what, Time now, FaultEntry more = {});
  void alter_bytes_of_datagrams(std::vector<protocol::Bytes>& datagrams, const Connection& stream, std::uint32_t ping, Time now);
  void note_message(Entry& entry, const Connection& to, std::uint32_t ping, const protocol::Bytes& before,
                    const protocol::Bytes& after, Time now, std::optional<std::size_t> place = {});
  std::uint32_t draw(const Entry& entry, std::uint32_t a, std::uint32_t b, std::uint32_t c) const;

  Around around_;
  Time start_;
  std::list<Entry> entries_;  // in the order of stages; entries of one stage are in the order of addition
  std::vector<FaultOrder> orders_;
};

}  // namespace sonar
