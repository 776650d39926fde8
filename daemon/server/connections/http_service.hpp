// Interface between HttpConnection, which transports requests and answers, and the service that answers: the control server or
// an emulated sonar.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

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
  // Both run until the socket closes.
  virtual asio::awaitable<void> read() = 0;
  virtual asio::awaitable<void> write() = 0;
  /// Called before we close the socket. May send a last message if that does not block.
  virtual void on_closing() = 0;
};

using HttpOutcome = std::variant<HttpAnswer, HttpStream, std::shared_ptr<HttpTakeover>>;

class HttpConnection;

class HttpService {
 public:
  virtual ~HttpService() = default;
  /// `from` outlives the call. It may wait on from.wait_timer(), which ends with the connection.
  virtual asio::awaitable<HttpOutcome> answer(const HttpRequest& request, HttpConnection& from) = 0;
  /// Returns the answer to a request that cannot be parsed, or for which no slot is free.
  virtual HttpAnswer refusal(const HttpRefusal& refusal) const = 0;
};

}  // namespace sonar
