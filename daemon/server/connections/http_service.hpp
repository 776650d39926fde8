// Interface between HttpConnection, which moves requests and answers, and the control server or an emulated sonar, which
// interpret them.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "daemon/server/connections/http_answer.hpp"
#include "daemon/server/connections/http_reader.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

/// An answer without an end, written piece by piece until the client disconnects.
struct HttpStream {
  std::string type;
  /// `wake`: there is a next piece. The stream is subscribed as long as what is returned lives.
  std::function<std::shared_ptr<void>(std::function<void()> wake)> subscribe;
  std::function<std::optional<std::string>()> next;  // nothing: wait
};

/// Takes the connection over: an upgrade to another protocol, with coroutines of its own in place of the connection's.
class HttpTakeover {
 public:
  virtual ~HttpTakeover() = default;
  /// Sends the answer to the request. False: close the connection.
  virtual asio::awaitable<bool> begin() = 0;
  // Both until the socket closes.
  virtual asio::awaitable<void> read() = 0;
  virtual asio::awaitable<void> write() = 0;
  /// The socket is about to be closed by us: last words, if they can be sent at once.
  virtual void on_closing() = 0;
};

using HttpOutcome = std::variant<HttpAnswer, HttpStream, std::shared_ptr<HttpTakeover>>;

class HttpConnection;

class HttpService {
 public:
  virtual ~HttpService() = default;
  /// `from` outlives the call. May wait on from.wait_timer(), which ends when the connection does.
  virtual asio::awaitable<HttpOutcome> answer(const HttpRequest& request, HttpConnection& from) = 0;
  /// Answer to a request that cannot be parsed, or that finds no slot.
  virtual HttpAnswer refusal(const HttpRefusal& refusal) const = 0;
};

}  // namespace sonar
