// One client of the control stream, which sends requests and gets answers and events. One coroutine reads, another writes;
// answers are sent as operations finish, in any order. The listener's slots and the coroutines own the object.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/server/api/events.hpp"
#include "daemon/server/api/operations.hpp"
#include "daemon/server/connections/connection_services.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/http/http_router.hpp"
#include "daemon/server/poses/pose_intake.hpp"
#include "protocol/control/control.hpp"

namespace sonar {

/// The parts of the daemon on which requests of control act.
struct ControlTargets {
  Operations& operations;
  Events& events;
  PoseIntake& poses;
  SharedRate pose_rate;  // limit for poses without an answer (request id 0)
};

class StreamConnection : public std::enable_shared_from_this<StreamConnection> {
 public:
  using Steady = std::chrono::steady_clock;
  /// Limit for requests in progress or with unread answers. At the limit, reading pauses.
  static constexpr std::size_t most_open_requests = 64;

  /// `services` and `targets` must outlive the connection.
  StreamConnection(ConnectionServices& services, ControlTargets& targets, tcp::socket socket, Sender sender);

  asio::awaitable<void> read();
  asio::awaitable<void> write();
  void close();
  bool over() const { return !socket_.is_open(); }
  /// Call it before read() if no slot is free.
  void reject() { ending_ = true; }
  /// Call it before read(). The client is untrusted until it sends the token; then `claim_slot` is called, which returns false
  /// if no slot is free.
  void must_claim_slot(std::function<bool()> claim_slot) { claim_slot_ = std::move(claim_slot); }
  const Sender& sender() const { return sender_; }

  Steady::time_point active_at = Steady::now();  // time of the last whole message, received or (for subscribers) sent
  bool proved = false;                           // true: the client has sent Hello

 private:
  struct Work {
    std::size_t bytes = 0, pose_bytes = 0;  // pose_bytes: the part of `bytes` for poses without an answer
  };
  bool accept(control::BytesView message, Work& work);
  bool is_beyond_pose_rate();
  asio::awaitable<void> take_newest_pose();
  asio::awaitable<void> limit_rate(const Work& work);
  bool greet(std::uint64_t id, const control::Hello& hello);
  bool accept_greeted(const control::Request& request);
  void perform(std::uint64_t id, const control::Operation& operation);
  void subscribe(const control::Subscribe& wanted);
  void answer(const v1::Response& response);
  bool refuse_and_end(std::uint64_t id, control::StatusCode code, const std::string& why);
  asio::awaitable<bool> write_whole(control::Bytes bytes);

  ConnectionServices& services_;
  ControlTargets& targets_;
  tcp::socket socket_;
  Sender sender_;
  std::shared_ptr<Deadline> greeting_, stall_;
  asio::steady_timer wake_reader_, wake_writer_, rest_;
  control::DelimitedParser parser_;
  InputRate rate_;
  std::optional<SharedRate::Part> pose_rate_;  // set with the first pose without an answer
  std::optional<control::Bytes> newest_pose_;  // newest pose beyond the rate
  std::deque<control::Bytes> answers_;         // framed answers
  std::size_t unsettled_ = 0;                  // bytes of answers and work of requests that are not counted yet
  std::size_t in_progress_ = 0;                // requests whose answer is not in answers_ yet
  EventQueue events_;
  Events::Token subscription_;
  HttpDetector http_;
  std::function<bool()> claim_slot_;       // empty if the client is trusted
  bool greeted_ = false, ending_ = false;  // ending_: only the remaining answers are still written
};

}  // namespace sonar
