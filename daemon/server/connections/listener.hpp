// A listening TCP socket and its accept loop: sonars, control and poses use it. No connection can stop it.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

class Listener {
 public:
  using Take = std::function<void(tcp::socket)>;
  using Fault = std::function<void(const std::string&)>;

  /// `purpose`: which of the spare descriptors may be used; nullopt: the caller asks `admission` for a slot itself. `admission`
  /// outlives the listener.
  Listener(asio::io_context& io, Admission& admission, std::optional<Admission::Purpose> purpose)
      : admission_(admission), purpose_(purpose), acceptor_(io), reopen_timer_(io) {}

  /// Port 0: the system chooses one. After an error it does not listen.
  Result<void> open(Endpoint at);
  /// `take` gets each connection, `fault` the text of an exception. Does nothing if the listener is not open. The object must
  /// live for 100 ms after stop(), because Admission may pause so long.
  void start(Take take, Fault fault);
  void stop();
  /// Closes the socket, so that connections are refused as at a port where no program listens.
  void pause();
  /// Accepts connections again, at the same address and port. It retries while another program has that port; then
  /// `taken` gets the reason, once.
  void resume(Fault taken);
  /// Returns true also while paused.
  bool is_open() const { return acceptor_.is_open() || paused_; }
  /// The address, with the port that the system chose. Port 0 = it was not opened.
  Endpoint at() const { return at_; }

 private:
  asio::awaitable<void> accept();
  asio::awaitable<void> reopen();
  void try_to_open();

  Admission& admission_;
  std::optional<Admission::Purpose> purpose_;
  tcp::acceptor acceptor_;
  asio::steady_timer reopen_timer_;
  Endpoint at_;
  Take take_;
  Fault fault_, taken_;
  bool stopping_ = false, paused_ = false;
};

}  // namespace sonar
