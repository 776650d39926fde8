// A listening TCP socket and its accept loop, for sonars, control and poses. An error of one connection does not end the loop.
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

  /// `purpose` selects the reserved descriptors that may be used; nullopt: the caller requests a slot of `admission`. `admission`
  /// must outlive the listener.
  Listener(asio::io_context& io, Admission& admission, std::optional<Admission::Purpose> purpose)
      : admission_(admission), purpose_(purpose), acceptor_(io), reopen_timer_(io) {}

  /// Opens the socket. With port 0 the system chooses a port. After an error the object does not listen.
  Result<void> open(Endpoint at);
  /// Passes each connection to `take`, and the text of an exception to `fault`. Does nothing if the listener is not open. The
  /// object must exist for 100 ms after stop(), the longest pause in Admission.
  void start(Take take, Fault fault);
  void stop();
  /// Closes the socket, so that connections are refused as at a port without a listener.
  void pause();
  /// Accepts connections again, at the same address and port. Retries while another program uses that port, and passes the reason
  /// to `taken` once.
  void resume(Fault taken);
  /// True also while paused.
  bool is_open() const { return acceptor_.is_open() || paused_; }
  /// Returns the address, with the port that the system chose. The port is 0 if the listener was never opened.
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
