// Decides which clients may open the live view's socket, and which clients may change settings, by the rules of
// docs/live-view.md.
#pragma once

#include <chrono>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/server/connections/http_reader.hpp"
#include "daemon/server/connections/token.hpp"

namespace sonar {

/// The secrets of one run, besides the token.
class ViewSecrets {
 public:
  using Steady = std::chrono::steady_clock;
  static constexpr std::chrono::seconds ticket_lasts{30};
  static constexpr std::size_t most_tickets = 64;

  /// Returns the key: 32 hexadecimal digits, new at every start; empty = none.
  const std::string& key() const { return key_; }
  void make_key();
  /// Makes a ticket, which admits one connection within ticket_lasts. If there are more than most_tickets, the oldest is
  /// removed.
  std::string new_ticket(Steady::time_point now);
  bool take_ticket(std::string_view shown, Steady::time_point now);

 private:
  std::string key_;
  std::deque<std::pair<std::string, Steady::time_point>> tickets_;
};

/// An accepted handshake.
struct ViewWelcome {
  std::string protocol;  // the protocol that both sides support
  bool may_steer = false;
  double most_hz = 0;     // rate limit for pictures, which the viewer requested; 0 = none
  std::string playback;   // vehicle whose trajectory the viewer requested; empty = none
  std::string recording;  // recording that the viewer requested; empty = the running sonars
};
struct ViewDoor {
  const Token& token;
  ViewSecrets& secrets;
  Ipv4 reached;  // local address of the connection
  const ControlConfig& config;
};
/// Accepts or refuses a handshake whose Host was checked. `query`: query of the target. A refusal is one sentence; its `why`
/// names the configuration that would allow the client.
std::variant<HttpAnswer, ViewWelcome> open_view(const HttpRequest& request,
                                                const std::vector<std::pair<std::string, std::string>>& query,
                                                const ViewDoor& door, ViewSecrets::Steady::time_point now);

}  // namespace sonar
