// Instructions that an emulated sonar returns from every call. The caller, which has the sockets, carries them out in order.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/emulator/log_line.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

/// Chosen by the caller; unique during the life of a Sonar.
using ConnectionId = std::uint64_t;

enum class Role { client, observer, stream };  // stream: the datagrams of a port of kind udp_stream

/// Compute this ping, then call Sonar::on_ping() with it.
struct ComputePing {
  PingRequest request;
};
/// The connection has a slot: read its bytes, and send the messages of its outbox.
struct Serve {
  ConnectionId connection = 0;
};
/// No slot is free: keep the connection open, but neither read nor write until Serve.
struct KeepWaiting {
  ConnectionId connection = 0;
};
/// Close the connection without sending a byte. The Sonar has no record of it.
struct Refuse {
  ConnectionId connection = 0;
  bool reset = false;  // true: send RST, not FIN
};
/// Open or close the ports of kind tcp_stream: an open port accepts connections, a closed one refuses them like a port without a
/// listener. All are open at the start.
struct Listen {
  bool on = true;
};
/// Stop or resume reading from this client. While reading is stopped, the client's TCP window fills.
struct ReadFrom {
  ConnectionId connection = 0;
  bool on = true;
};
/// Write the rest of the current message without the pauses of a fault.
struct EndPauses {
  ConnectionId connection = 0;
};
/// Write the waiting messages of the outbox.
struct Wake {
  ConnectionId connection = 0;
};
/// Send the rest of the current message and the waiting replies, then end the stream; on_closed() follows.
struct Finish {
  ConnectionId connection = 0;
  std::string why;
};
/// Close the connection at once; on_closed() follows. Not for a stream.
struct Reset {
  ConnectionId connection = 0;
  std::string why;
};
/// A connection was closed, and the Sonar has removed it.
struct Closed {
  std::string peer;  // name of the peer
  Role role{};
  bool served = false;  // false: the connection was waiting for a slot
  std::uint64_t pings_written = 0, pings_dropped = 0;
  std::string why;
  bool by_client = false;     // true: the client closed the connection
  bool for_commands = false;  // true: the port never has pings
};
/// The content of the status broadcast has changed: send the broadcast now.
struct Announce {};
/// A ping was framed, and queued for every client, observer and stream that gets the ping.
struct PingQueued {
  std::shared_ptr<const Ping> ping;
  std::shared_ptr<const protocol::Bytes> bytes;                                // null: not sent over TCP
  std::vector<std::shared_ptr<const std::vector<protocol::Bytes>>> datagrams;  // one element for each stream with receivers
  double simulation_s = 0;
  bool preview = false;                             // true: the ping is only for viewers of the live view
  std::optional<protocol::Distance> distance = {};  // result of a range finder, unless a fault withholds the ping
};
/// A line for the log. The lines of one topic share a rate limit.
struct Report {
  enum class Topic { settings, notice, ignored, refused_ping, state, fault, topics } topic{};
  LogLine line;
};
/// The engine has failed, so no sonar can continue.
struct EngineFailed {
  Error why;
};

using Action = std::variant<ComputePing, Serve, KeepWaiting, Refuse, Listen, ReadFrom, EndPauses, Wake, Finish, Reset, Closed,
                            Announce, PingQueued, Report, EngineFailed>;
using Actions = std::vector<Action>;

/// Adds a log line about a sonar.
inline void report(const std::string& sonar, Report::Topic topic, LogLevel level, std::string phrase,
                   std::vector<LogField> fields, Actions& actions) {
  fields.insert(fields.begin(), {"sonar", sonar});
  actions.emplace_back(Report{topic, {level, std::move(phrase), std::move(fields)}});
}

/// The recorded bytes of a ping, with the number of the port that sends them; 0: every port.
using PartsByPort = std::vector<std::pair<std::uint16_t, protocol::Bytes>>;
/// Outcome of a PingRequest.
struct PingOutcome {
  std::shared_ptr<const Ping> ping = nullptr;  // null on failure
  std::string failure = {};
  bool refused = false;                                   // only this ping failed: invalid request, or no memory left
  ErrorKind kind = ErrorKind::bug;                        // kind of a failure of the engine
  double seconds = 0;                                     // wall time of the computation, without the pings of other sonars
  std::shared_ptr<const PartsByPort> recorded = nullptr;  // replaces the vendor's encoding; empty: nothing is sent
};

}  // namespace sonar
