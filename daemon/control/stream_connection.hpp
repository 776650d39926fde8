// One client of the control stream: requests in, answers and events out. One coroutine reads, one writes; answers to what takes
// time come when they come. Owned by the StreamServer's places and by its own coroutines.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/control/control_context.hpp"
#include "daemon/control/event_queue.hpp"
#include "daemon/sonars/input_rate.hpp"
#include "protocol/control/control.hpp"
#include "protocol/control/delimited.hpp"

namespace sonar {

class StreamConnection : public std::enable_shared_from_this<StreamConnection> {
 public:
  using Steady = std::chrono::steady_clock;
  /// Requests that may be under way or answered but not yet read by the client; then it is read no further.
  static constexpr std::size_t most_open_requests = 64;

  StreamConnection(ControlContext& context, tcp::socket socket, Sender sender);

  asio::awaitable<void> read();
  asio::awaitable<void> write();
  void close();
  bool over() const { return !socket_.is_open(); }
  /// Before it reads: there is no place for it.
  void turn_away() { ending_ = true; }
  /// Before it reads: it is a stranger until it shows the token; `let_in` then says whether there is a place for it.
  void asks_for_place(std::function<bool()> let_in) { let_in_ = std::move(let_in); }
  const Sender& sender() const { return sender_; }

  Steady::time_point heard_at = Steady::now();  // or written to: a subscriber says nothing

 private:
  bool speaks_http(std::span<const std::byte> received);
  struct Work {
    std::size_t bytes = 0, pose_bytes = 0;  // pose_bytes: those of poses that nobody wants an answer to, counted in both
  };
  bool take(control::BytesView message, Work& work);
  asio::awaitable<void> rest(const Work& work);
  bool greet(std::uint64_t id, const control::Hello& hello);
  bool take_greeted(const control::Request& request);
  void perform(std::uint64_t id, const control::Operation& operation);
  void subscribe(const control::Subscribe& wanted);
  void answer(const control::Response& response);
  bool refuse_and_end(std::uint64_t id, const std::string& why);
  asio::awaitable<bool> write_whole(control::Bytes bytes);

  ControlContext& context_;
  tcp::socket socket_;
  Sender sender_;
  std::shared_ptr<Deadline> greeting_, stall_;
  asio::steady_timer wake_reader_, wake_writer_, rest_;
  control::DelimitedParser parser_;
  InputRate rate_;
  std::optional<SharedRate::Part> pose_rate_;  // from the first pose that nobody wants an answer to
  std::deque<control::Bytes> answers_;         // framed
  std::size_t under_way_ = 0;                  // requests whose answer is not in answers_ yet
  EventQueue events_;
  Events::Token subscription_;
  std::string first_bytes_;                // until they are enough to know HTTP by
  std::function<bool()> let_in_;           // empty: it is in
  bool greeted_ = false, ending_ = false;  // ending: the last answer is being written
};

}  // namespace sonar
