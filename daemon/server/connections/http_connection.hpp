// Serves one HTTP client: requests one after the other, or a stream until the client disconnects. read() parses requests and
// write() answers them; an HttpService (of the control server or of an emulated sonar) makes the answers. The listener's slots
// and the coroutines of the connection own it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "daemon/server/connections/connection_services.hpp"
#include "daemon/server/connections/http_reader.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

/// An endless answer, written in pieces until the client disconnects.
struct HttpStream {
  std::string type;
  /// Subscribes; `wake` is called when a piece is available. The subscription ends with the returned object.
  std::function<std::shared_ptr<void>(std::function<void()> wake)> subscribe;
  std::function<std::optional<std::string>()> next;  // nullopt: wait for `wake`
};

/// An upgrade to another protocol, whose coroutines replace those of the connection.
class HttpTakeover {
 public:
  virtual ~HttpTakeover() = default;
  /// Sends the answer to the request. Returns false if the connection must be closed.
  virtual asio::awaitable<bool> begin() = 0;
  // read() and write() run until the socket closes.
  virtual asio::awaitable<void> read() = 0;
  virtual asio::awaitable<void> write() = 0;
  /// Called before the server closes the socket. May send a last message if that does not block.
  virtual void on_closing() = 0;
};

using HttpOutcome = std::variant<HttpAnswer, HttpStream, std::shared_ptr<HttpTakeover>>;

class HttpConnection;

class HttpService {
 public:
  virtual ~HttpService() = default;
  /// `from` outlives the call. The service may wait on from.wait_timer(), which ends with the connection.
  virtual asio::awaitable<HttpOutcome> answer(const HttpRequest& request, HttpConnection& from) = 0;
  /// Returns the answer to a request that cannot be parsed, or for which no slot is free.
  virtual HttpAnswer refusal(const HttpRefusal& refusal) const = 0;
};

class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  using Steady = std::chrono::steady_clock;

  /// `services` and `service` must outlive the connection.
  HttpConnection(ConnectionServices& services, HttpService& service, tcp::socket socket, const Sender& sender);

  asio::awaitable<void> read();
  asio::awaitable<void> write();
  void close();
  bool over() const { return !socket_.is_open(); }
  /// Call it before read() if no slot is free. Answers 503 and discards input for a moment.
  void reject();
  /// Call it before read(). The client is untrusted until it sends the token; then `claim_slot` is called, which returns false
  /// if no slot is free.
  void must_claim_slot(std::function<bool()> claim_slot) { claim_slot_ = std::move(claim_slot); }
  const Sender& sender() const { return sender_; }
  /// Returns the address of this end of the connection.
  Endpoint reached() const { return reached_; }
  /// Returns the address of the other end.
  Ipv4 peer() const { return peer_; }
  /// Claims a slot for a client whose token the service has checked. Returns false if no slot is free.
  bool claim_slot() { return !claim_slot_ || std::exchange(claim_slot_, nullptr)(); }
  /// Returns the socket, for an HttpTakeover.
  tcp::socket& socket() { return socket_; }
  /// Returns a timer for the service while it makes an answer.
  asio::steady_timer& wait_timer() { return wake_operation_; }

  /// Counts work in addition to the size of the answer.
  void charge(std::size_t work) { services_.pause_after(sender_, work); }
  /// Returns the time that an HttpTakeover must wait after this much work.
  Steady::duration pause_after(std::size_t work) { return services_.pause_after(sender_, work); }

  Steady::time_point active_at = Steady::now();  // time of the last whole request or answer
  bool proved = false;                           // true: a whole request has arrived

 private:
  struct Head {  // head of the answer to a request
    bool http_1_0 = false, without_body = false, last = false;
  };
  void hand_over();
  asio::awaitable<void> settle(std::size_t work);
  asio::awaitable<void> answer(HttpRequest request);
  bool has_slot(const HttpRequest& request);
  asio::awaitable<void> write_stream(HttpStream stream, Head head);
  asio::awaitable<bool> write_answer(HttpAnswer answer, Head head);
  asio::awaitable<bool> write_whole(std::string bytes);
  void next_request();
  void finish_sending();

  ConnectionServices& services_;
  HttpService& service_;
  tcp::socket socket_;
  Sender sender_;  // address without the port, because each connection of a program has another port
  Endpoint reached_;
  Ipv4 peer_{};
  std::shared_ptr<Deadline> request_limit_, stall_;
  asio::steady_timer wake_reader_, wake_writer_, wake_operation_, rest_;
  HttpReader reader_;
  std::optional<HttpRequest> request_;  // request that is not yet answered
  std::optional<HttpRefusal> refusal_;  // refusal of a request that cannot be parsed
  std::function<bool()> claim_slot_;    // empty: the client is trusted
  std::shared_ptr<HttpTakeover> takeover_;
  std::size_t unsettled_ = 0;    // work of the answer that is not counted yet
  bool continue_asked_ = false;  // true: "100 Continue" must be sent
  bool busy_ = false;            // true: a request is being answered
  bool discards_ = false;        // true: input is discarded
  bool peer_closed_ = false;     // true: the client sends no more
  bool all_sent_ = false;        // true: the server sends no more
};

}  // namespace sonar
