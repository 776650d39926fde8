// One HTTP client: requests one after the other, or a stream of events until it leaves. read() takes requests off the socket and
// write() answers them. Owned by the HTTP server's places and by its own coroutines.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/control/control_context.hpp"
#include "daemon/control/event_queue.hpp"
#include "daemon/control/http_judge.hpp"

namespace sonar {

class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  using Steady = std::chrono::steady_clock;

  HttpConnection(ControlContext& context, tcp::socket socket, Sender sender);

  asio::awaitable<void> read();
  asio::awaitable<void> write();
  void close();
  bool over() const { return !socket_.is_open(); }
  /// Before it reads: there is no place for it. It says 503 and hears the client out for a moment.
  void turn_away();
  /// Before it reads: it is a stranger until it shows the token; `let_in` then says whether there is a place for it.
  void asks_for_place(std::function<bool()> let_in) { let_in_ = std::move(let_in); }
  const Sender& sender() const { return sender_; }

  Steady::time_point heard_at = Steady::now();

 private:
  struct Head {  // of the answer to a request
    bool http_1_0 = false, without_body = false, last = false;
  };
  void hand_over();
  asio::awaitable<void> answer(HttpRequest request);
  bool has_place(const HttpRequest& request);
  asio::awaitable<HttpAnswer> make_answer(Wanted wanted);
  asio::awaitable<HttpAnswer> carry_out(control::Operation operation);
  asio::awaitable<void> stream_events(control::Subscribe wanted, Head head);
  asio::awaitable<bool> write_answer(HttpAnswer answer, Head head);
  asio::awaitable<bool> write_whole(std::string bytes);
  HttpAnswer health(bool with_text) const;
  void next_request();
  void goodbye();

  ControlContext& context_;
  tcp::socket socket_;
  Sender sender_;  // the address without the port: every curl has another
  Endpoint reached_;
  std::shared_ptr<Deadline> request_limit_, stall_;
  asio::steady_timer wake_reader_, wake_writer_, wake_operation_, rest_;
  HttpReader reader_;
  std::optional<HttpRequest> request_;  // read, not yet answered
  std::optional<HttpRefusal> refusal_;  // of what cannot be read
  EventQueue events_;
  std::function<bool()> let_in_;  // empty: it is in
  bool continue_asked_ = false;   // "100 Continue" is wanted
  bool busy_ = false;             // a request is being answered
  bool discards_ = false;         // what the client sends, it does not count any more
  bool ended_ = false;            // the client sends nothing more
  bool said_all_ = false;         // nor do we
};

}  // namespace sonar
