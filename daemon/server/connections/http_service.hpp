// What an HTTP server answers: the interface between HttpConnection, which moves requests and answers, and the control server or
// an emulated sonar, which know what they mean.
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

class HttpConnection;

class HttpService {
 public:
  virtual ~HttpService() = default;
  /// `from` outlives the call. May wait on from.wait_timer(), which ends when the connection does.
  virtual asio::awaitable<std::variant<HttpAnswer, HttpStream>> answer(const HttpRequest& request, HttpConnection& from) = 0;
  /// Of a request that cannot be parsed, or that finds no slot.
  virtual HttpAnswer refusal(const HttpRefusal& refusal) const = 0;
};

}  // namespace sonar
