#include "daemon/server/sonars/session.hpp"

#include <linux/sockios.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cassert>

#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

// Limit of bytes in the kernel that are not yet on the wire. A larger limit would only make a slow client's picture older.
constexpr int unsent_limit_bytes = 256 * 1024;
constexpr std::size_t piece_bytes = 256;  // bytes of a client that are processed at a time
constexpr auto idle_watch = std::chrono::seconds(1);
constexpr auto delivery_watch = std::chrono::milliseconds(1), fin_watch = std::chrono::milliseconds(50);

std::string reason(const error_code& ec) {
  if (ec == asio::error::eof) return "closed by the client";
  return ec == asio::error::timed_out ? "connection timed out: the peer stopped reading and answering" : ec.message();
}

/// Sends small messages at once, and lets few bytes wait in the kernel, because pings in the outbox can still be replaced.
void prepare(tcp::socket& socket, const LimitConfig& limits) {
  error_code ec;  // the options are not essential, so errors are ignored
  socket.set_option(tcp::no_delay(true), ec);
  using UnsentLimit = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;
  socket.set_option(UnsentLimit(unsent_limit_bytes), ec);
  end_when_silent(socket, limits.dead_peer);  // detects a peer that vanished without FIN while little or nothing is sent
}

}  // namespace

Peer peer_of(const tcp::socket& socket) {
  error_code ec;
  const tcp::endpoint at = socket.remote_endpoint(ec);
  return {at.address().to_string() + ":" + std::to_string(at.port()),
          at.address().is_v4() ? at.address().to_v4().to_bytes() : protocol::Ipv4{}};
}

Session::Session(SessionParent& parent, tcp::socket socket, const Setup& setup)
    : parent_(parent),
      socket_(std::move(socket)),
      setup_(setup),
      input_rate_(setup.limits.input_bytes_per_s),
      wake_reader_(socket_.get_executor()),
      wake_writer_(socket_.get_executor(), Steady::time_point::max()),
      wake_watch_(socket_.get_executor()),
      pause_(socket_.get_executor()) {
  prepare(socket_, setup_.limits);
  const std::size_t per_s = setup_.limits.input_bytes_per_s;
  input_rate_.pause_after(per_s - std::min(per_s, at_once), connected_at_);
}

// A session has three coroutines on the I/O thread: read() passes bytes to the sonar, write() takes messages from the outbox,
// watch() ends the session of a client that reads nothing or is silent. A session is first serving, then finishing_ (the last
// messages, then FIN), then over_ (the socket is closed). Each coroutine tests over_ after every wait, because another coroutine
// may have ended the session.
void Session::start() {
  spawn(&Session::read);
  spawn(&Session::write);
  spawn(&Session::watch);
}

/// Starts a coroutine. An exception in it ends the session, which would otherwise keep its slot forever.
void Session::spawn(asio::awaitable<void> (Session::*part)()) {
  const auto self = shared_from_this();
  asio::co_spawn(
      socket_.get_executor(), [self, part] { return ((*self).*part)(); },
      [self](std::exception_ptr fault) {
        if (!fault) return;
        self->parent_.on_fault(text_of(fault));
        self->reset("an internal fault");
      });
}

asio::awaitable<void> Session::read() {
  const auto self = shared_from_this();
  while (!over_) {
    error_code ec;
    const std::size_t n = co_await socket_.async_read_some(asio::buffer(received_), into(ec));
    if (over_) co_return;
    if (ec) {
      over_after(ec);
      co_return;
    }
    // While a fault stops reading, these bytes wait here, and later bytes wait in the kernel.
    while (!reading_ && !finishing_ && !over_) co_await rest(never);
    if (over_) co_return;
    received_at_ = Steady::now();
    // An HTTP request must have no effect, and must not occupy a driver's slot.
    if (http_.speaks_http(std::span(received_).first(n))) co_return over("it speaks HTTP");
    co_await pass_on(std::span(received_).first(n));
  }
}

/// Passes bytes to the sonar in small pieces, so that a client over its limit of work waits before its next requests act.
asio::awaitable<void> Session::pass_on(protocol::BytesView bytes) {
  while (!bytes.empty() && !over_) {
    const auto piece = bytes.first(std::min(bytes.size(), piece_bytes));
    bytes = bytes.subspan(piece.size());
    const std::size_t work = piece.size() + parent_.on_bytes(setup_.id, piece);
    const auto pause = input_rate_.pause_after(work, Steady::now());
    if (pause.count() > 0 && !finishing_ && !over_) co_await rest(Steady::now() + pause);
  }
}

/// Pauses reading from a client that sends too much; even FIN is read only after the pause. finish() and over() end the pause.
asio::awaitable<void> Session::rest(Steady::time_point until) {
  wake_reader_.expires_at(until);
  error_code ec;
  co_await wake_reader_.async_wait(into(ec));
}

void Session::read_from_client(bool on) {
  if (std::exchange(reading_, on) || !on) return;
  received_at_ = Steady::now();
  wake_reader_.cancel();
}

void Session::wake() { wake_writer_.cancel(); }

/// Writes a message; a ping with prefixes is sent once after each prefix. Returns false if the session is over.
asio::awaitable<bool> Session::write_whole(const Outbox::Message& message) {
  if (message.shape) {
    assert(message.prefixes.empty());
    co_return co_await write_shaped(*message.bytes, *message.shape);
  }
  if (message.prefixes.empty()) co_return co_await write_bytes(*message.bytes);
  for (const protocol::Bytes& prefix : message.prefixes) {
    if (!co_await write_bytes(prefix)) co_return false;
    if (!co_await write_bytes(*message.bytes)) co_return false;
  }
  co_return true;
}

/// Writes bytes, which must stay valid until it returns.
asio::awaitable<bool> Session::write_bytes(protocol::BytesView bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    error_code ec;
    const std::size_t n = co_await socket_.async_write_some(asio::buffer(bytes.data() + done, bytes.size() - done), into(ec));
    if (over_) co_return false;
    if (ec) {
      over_after(ec);
      co_return false;
    }
    if (setup_.digest) digest_.add(bytes.subspan(done, n));
    done += n;
    parent_.on_sent(setup_.id, n);
    progress_at_ = Steady::now();
  }
  co_return true;
}

/// Writes a message in parts, with pauses at the positions that a fault or the port defines. Before a reset it waits until the
/// client has the bytes.
asio::awaitable<bool> Session::write_shaped(protocol::BytesView bytes, const Outbox::Shape& shape) {
  for (std::size_t done = 0; const Outbox::Shape::Pause& pause : shape.pauses) {
    // Positions of pauses count from the start of the message; `bytes` is the rest of the message.
    const std::size_t count = std::clamp(pause.before, done, done + bytes.size()) - done;
    if (!co_await write_bytes(bytes.first(count)) || !co_await pause_writing(pause.length)) co_return false;
    bytes = bytes.subspan(count);
    done += count;
  }
  if (!co_await write_bytes(bytes)) co_return false;
  co_return shape.end != Outbox::Shape::End::reset || co_await deliver();
}

/// Pauses. A pause does not count as a stall, because `progress_at_` is set to its end. finish() and over() end the pause.
asio::awaitable<bool> Session::pause_writing(std::chrono::nanoseconds length) {
  if (length.count() > 0 && !finishing_ && !hurries_) {
    progress_at_ = Steady::now() + length;
    pause_.expires_at(progress_at_);
    error_code ec;
    co_await pause_.async_wait(into(ec));
    progress_at_ = Steady::now();
  }
  co_return !over_;
}

void Session::end_pauses() {
  // Only the current message is sent without pauses.
  hurries_ = writing_;
  pause_.cancel();
}

/// Returns the number of bytes in the kernel that the client has not acknowledged; 0 if the kernel does not report it.
int Session::unconfirmed_bytes() {
  int bytes = 0;
  return ::ioctl(socket_.native_handle(), SIOCOUTQ, &bytes) == 0 ? bytes : 0;
}

/// Returns the time since the last progress of the current message.
std::chrono::steady_clock::duration Session::stands_for() const {
  return writing_ ? std::max(Steady::duration{}, Steady::now() - progress_at_) : Steady::duration{};
}

/// Waits until the client has acknowledged everything, because a reset discards the rest. watch() ends the session of a client
/// that reads nothing.
asio::awaitable<bool> Session::deliver() {
  while (!over_ && unconfirmed_bytes() > 0) {
    pause_.expires_after(delivery_watch);
    error_code ec;
    co_await pause_.async_wait(into(ec));
  }
  co_return !over_;
}

/// Ends the connection after a message that a fault has shaped, with the time limit for faults.
void Session::end_by(Outbox::Shape::End end) {
  if (end == Outbox::Shape::End::reset) return reset("a fault reset the connection");
  finish("a fault ended the stream");
  finish_by_ = Steady::now() + fault_fin_limit;
  fin_by_fault_ = true;
  send_fin();
}

/// Sends FIN. Then read() waits for the client's FIN, and watch() for the deadline.
void Session::send_fin() {
  error_code ec;
  socket_.shutdown(tcp::socket::shutdown_send, ec);
  sent_fin_ = true;
  fin_at_ = Steady::now();
  wake_watch_.cancel();
}

/// Writes whole messages one by one. If none waits, it waits for wake() or, when finishing_, sends FIN.
asio::awaitable<void> Session::write() {
  const auto self = shared_from_this();
  while (!over_) {
    const Outbox::Message message = parent_.next_message(setup_.id);
    error_code ec;
    if (message) {
      writing_ = true;
      ping_ = message.ping;
      progress_at_ = Steady::now();
      if (!co_await write_whole(message)) co_return;
      writing_ = hurries_ = false;
      parent_.on_written(setup_.id, message);
      if (message.shape && message.shape->end != Outbox::Shape::End::none) co_return end_by(message.shape->end);
    } else if (finishing_) {
      co_return send_fin();
    } else {
      co_await wake_writer_.async_wait(into(ec));
    }
  }
}

/// Returns the time of the next check: in a second, or at an earlier deadline.
Session::Steady::time_point Session::watch_until() const {
  auto until = Steady::now() + idle_watch;
  if (finishing_) until = std::min(until, finish_by_);
  // After our FIN, checks often whether the client has acknowledged all bytes.
  if (sent_fin_ && !fin_by_fault_) until = std::min(until, std::max(fin_at_ + fin_limit, Steady::now() + fin_watch));
  return until;
}

/// True if the client has acknowledged all bytes after our FIN and has had time to send its own FIN.
bool Session::has_all(Steady::time_point now) {
  return sent_fin_ && !fin_by_fault_ && now >= fin_at_ + fin_limit && unconfirmed_bytes() <= 0;
}

asio::awaitable<void> Session::watch() {
  const auto self = shared_from_this();
  while (!over_) {
    wake_watch_.expires_at(watch_until());
    error_code ec;
    co_await wake_watch_.async_wait(into(ec));
    if (over_) co_return;
    const auto now = Steady::now();
    if (finishing_ && (now >= finish_by_ || has_all(now))) {
      if (!sent_fin_) reset("did not receive its last message in time");
      over(why_);
    } else if (writing_ && now - progress_at_ > setup_.limits.stall) {
      reset("read no byte for " + std::to_string(setup_.limits.stall.count()) + " ms");
    } else if (!finishing_ && is_silent(now)) {
      finish("silent for " + std::to_string(parent_.longest_silence(setup_.id)->count() / 1000) + " s");
    }
  }
}

/// True if the client has sent nothing for too long. Unread bytes count, because this process may have been suspended for a
/// while.
bool Session::is_silent(Steady::time_point now) const {
  const auto longest = parent_.longest_silence(setup_.id);
  error_code ec;
  return longest && reading_ && now - received_at_ > *longest && socket_.available(ec) == 0;
}

/// Begins an orderly end: write() sends the current message and waiting replies, then FIN; the client may still close first. All
/// four waits are cancelled, so that each coroutine checks `finishing_`.
void Session::finish(std::string why) {
  if (over_ || finishing_) return;
  finishing_ = true;
  why_ = std::move(why);
  finish_by_ = Steady::now() + finish_limit;
  parent_.on_finish(setup_.id);
  wake_reader_.cancel();
  wake_writer_.cancel();
  wake_watch_.cancel();
  pause_.cancel();
}

// With linger 0, close() sends RST and discards unsent bytes.
void Session::reset(std::string why) {
  if (over_) return;
  error_code ec;
  socket_.set_option(asio::socket_base::linger(true, 0), ec);
  over(std::move(why));
}

void Session::end_if_closed() {
  error_code ec;
  // Unread bytes of a client that has disconnected are still processed; then read() reaches its FIN.
  if (over_ || !has_left(socket_) || socket_.available(ec) > 0) return;
  int fault = 0;
  socklen_t size = sizeof fault;
  ::getsockopt(socket_.native_handle(), SOL_SOCKET, SO_ERROR, &fault, &size);
  ec = fault == 0 ? error_code(asio::error::eof) : error_code(fault, boost::system::system_category());
  over_after(ec);
}

/// Ends the session after an error. If finish() was called before, its reason is kept.
void Session::over_after(const error_code& ec) {
  const bool left = ec == asio::error::eof || ec == asio::error::connection_reset || ec == asio::error::broken_pipe;
  if (finishing_)
    over(why_);
  else
    over(reason(ec), left);
}

/// Ends the session: closes the socket, wakes the coroutines so that they return, and reports the end.
void Session::over(std::string why, bool by_client) {
  if (std::exchange(over_, true)) return;
  error_code ec;
  socket_.close(ec);
  wake_reader_.cancel();
  wake_writer_.cancel();
  wake_watch_.cancel();
  pause_.cancel();
  parent_.on_over(setup_.id, why, by_client);
}

}  // namespace sonar
