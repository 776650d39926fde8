// A client of a daemon's control stream: Hello, requests and their answers, events. Calls block, with a time limit.
#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <string>

#include "clients/sonarctl/net.hpp"
#include "protocol/control/control.hpp"

namespace sonar::v1 {  // from control.pb.h
class DaemonStatus;
class Event;
}  // namespace sonar::v1

namespace sonar::clients {

inline constexpr std::uint16_t control_port = 14770;

struct ControlOptions {
  std::string address;               // HOST:PORT, empty = 127.0.0.1:14770
  std::filesystem::path token_file;  // the daemon's control.token_file, if it has one
  std::chrono::milliseconds connect_patience{2000};
  /// sonard answers Hello at once, even if busy. No answer within this time means that another service listens there.
  std::chrono::milliseconds greeting_patience{2000};
};

class ControlClient {
 public:
  using Operation = decltype(control::Request::op);
  using Response = std::shared_ptr<const v1::Response>;
  static constexpr std::chrono::milliseconds usual_patience{10000};

  /// Connects and sends Hello. Returns an error if there is no connection, another service answers, or the token is missing or
  /// wrong. `token_required` is set if sonard requires a token but no token file is given.
  static Result<ControlClient> open(const ControlOptions& options, bool* token_required = nullptr);

  /// Sends a request and returns its answer; a refusal is an error with sonard's text. Events that arrive meanwhile are kept.
  Result<Response> request(Operation operation, std::chrono::milliseconds patience = usual_patience);
  Result<std::shared_ptr<const v1::DaemonStatus>> status(std::chrono::milliseconds patience = usual_patience);
  /// Returns the next subscribed event; null after `patience`, or after a signal.
  Result<std::shared_ptr<const v1::Event>> next_event(std::chrono::milliseconds patience);

  const Endpoint& at() const { return at_; }

 private:
  ControlClient(Socket socket, Endpoint at) : socket_(std::move(socket)), at_(std::move(at)) {}
  Result<Response> next_message(std::chrono::steady_clock::time_point deadline, bool until_signal);
  Error no_control_stream(const std::string& why) const;

  Socket socket_;
  Endpoint at_;
  control::DelimitedParser parser_;
  bool received_ = false;  // any byte has arrived
  std::deque<std::shared_ptr<const v1::Event>> events_;
  std::uint64_t last_id_ = 0;
  bool unauthenticated_ = false;  // the last answer had the status UNAUTHENTICATED
};

}  // namespace sonar::clients
