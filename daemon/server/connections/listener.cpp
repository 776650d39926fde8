#include "daemon/server/connections/listener.hpp"

#include <utility>

#include "daemon/server/system/listen.hpp"

namespace sonar {

Result<void> Listener::open(Endpoint at) {
  error_code ec;
  if (auto r = listen_tcp(acceptor_, at); !r) {
    acceptor_.close(ec);
    return r;
  }
  at_ = {at.ip, acceptor_.local_endpoint(ec).port()};
  return {};
}

void Listener::start(Take take, Fault fault) {
  take_ = std::move(take);
  fault_ = std::move(fault);
  if (!acceptor_.is_open()) return;
  keep_running(
      acceptor_.get_executor(), [this] { return accept(); },
      [this](const std::string& text) {
        if (!stopping_) fault_(text);
        return !stopping_;
      });
}

void Listener::stop() {
  stopping_ = true;
  error_code ec;
  acceptor_.close(ec);
}

asio::awaitable<void> Listener::accept() {
  while (!stopping_) {
    std::optional<tcp::socket> socket;
    if (purpose_)
      socket = co_await admission_.next_visitor(acceptor_, *purpose_);
    else
      socket = co_await admission_.accept(acceptor_);
    if (!socket || stopping_) co_return;
    take_(*std::move(socket));
  }
}

}  // namespace sonar
