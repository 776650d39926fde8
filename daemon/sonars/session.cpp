#include "daemon/sonars/session.hpp"

#include <netinet/tcp.h>

#include <algorithm>

#include "daemon/system/listen.hpp"

namespace sonar {
namespace {

// Bytes the kernel may hold that are not yet on the wire. More would only make a slow client's picture older.
constexpr int unsent_limit_bytes = 256 * 1024;
constexpr auto idle_watch = std::chrono::seconds(1);
constexpr auto shortest_rhythm = std::chrono::milliseconds(1);  // of a conversation's ticks in stepped time

std::string reason(const error_code& ec) {
  if (ec == asio::error::eof) return "closed by the client";
  return ec == asio::error::timed_out ? "takes no byte and does not answer any more" : ec.message();
}

void prepare(tcp::socket& socket, const LimitConfig& limits) {
  error_code ec;  // a refused option costs smoothness, not correctness
  socket.set_option(tcp::no_delay(true), ec);
  using UnsentLimit = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;
  socket.set_option(UnsentLimit(unsent_limit_bytes), ec);
  end_when_silent(socket, limits.dead_peer);  // one that is gone without a word, while little or nothing is sent to it
}

}  // namespace

Session::Session(SessionParent& parent, const Clock& clock, tcp::socket socket, std::unique_ptr<protocol::Dialogue> dialogue,
                 const Setup& setup)
    : parent_(parent),
      clock_(clock),
      socket_(std::move(socket)),
      dialogue_(std::move(dialogue)),
      setup_(setup),
      outbox_(setup.outbox),
      input_rate_(setup.limits.input_bytes_per_s),
      wake_reader_(socket_.get_executor()),
      wake_writer_(socket_.get_executor(), Steady::time_point::max()),
      wake_watch_(socket_.get_executor()) {
  error_code ec;
  peer_ = socket_.remote_endpoint(ec);
  client_ = peer_.address().to_string() + ":" + std::to_string(peer_.port());
  prepare(socket_, setup_.limits);
}

protocol::Ipv4 Session::client_ip() const {
  return peer_.address().is_v4() ? peer_.address().to_v4().to_bytes() : protocol::Ipv4{};
}

void Session::start() {
  spawn(&Session::read);
  spawn(&Session::write);
  spawn(&Session::watch);
}

/// A session without one of its parts would hold its place for ever: an exception ends it, and it alone.
void Session::spawn(asio::awaitable<void> (Session::*part)()) {
  const auto self = shared_from_this();
  asio::co_spawn(
      socket_.get_executor(), [self, part] { return ((*self).*part)(); },
      [self](std::exception_ptr fault) {
        if (!fault) return;
        self->parent_.on_fault(*self, text_of(fault));
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
      over(finishing_ ? why_ : reason(ec));
      co_return;
    }
    bytes_read_ += n;
    heard_at_ = Steady::now();
    not_before_ = {};
    if (!finishing_) handle(dialogue_->on_bytes(std::span(received_).first(n), clock_.lived()));
    const auto pause = input_rate_.pause_after(n, Steady::now());
    if (pause.count() > 0 && !finishing_) co_await rest(pause);
  }
}

/// A client that sends too much waits; its goodbye, too, is only read then. finish() and over() end the pause.
asio::awaitable<void> Session::rest(Steady::duration pause) {
  wake_reader_.expires_after(pause);
  error_code ec;
  co_await wake_reader_.async_wait(into(ec));
}

void Session::handle(protocol::Reaction reaction) {
  std::string close_why;
  for (const protocol::Event& event : reaction.events) {
    if (const auto* close = std::get_if<protocol::Close>(&event))
      close_why = close->why;
    else
      parent_.on_event(*this, event);
    if (over_) return;
  }
  for (protocol::Bytes& reply : reaction.replies)
    if (!outbox_.push_reply(std::move(reply))) return reset("asks faster than it reads the answers");
  if (!close_why.empty()) return finish(close_why);
  wake_writer_.cancel();
  wake_watch_.cancel();
}

asio::awaitable<bool> Session::write_whole(const Outbox::Message& message) {
  if (message.prefixes.empty()) co_return co_await write_bytes(*message.bytes);
  for (const protocol::Bytes& prefix : message.prefixes) {
    if (!co_await write_bytes(prefix)) co_return false;
    if (!co_await write_bytes(*message.bytes)) co_return false;
  }
  co_return true;
}

/// The bytes must live until it is done.
asio::awaitable<bool> Session::write_bytes(protocol::BytesView bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    error_code ec;
    const std::size_t n = co_await socket_.async_write_some(asio::buffer(bytes.data() + done, bytes.size() - done), into(ec));
    if (over_) co_return false;
    if (ec) {
      over(reason(ec));
      co_return false;
    }
    if (setup_.digest) digest_.add(bytes.subspan(done, n));
    done += n;
    bytes_written_ += n;
    progress_at_ = Steady::now();
  }
  co_return true;
}

asio::awaitable<void> Session::write() {
  const auto self = shared_from_this();
  while (!over_) {
    const Outbox::Message message = outbox_.take();
    error_code ec;
    if (message) {
      writing_ = true;
      progress_at_ = Steady::now();
      if (!co_await write_whole(message)) co_return;
      writing_ = false;
      outbox_.written();
      parent_.on_written(*this, message);
    } else if (finishing_) {
      socket_.shutdown(tcp::socket::shutdown_send, ec);
      said_goodbye_ = true;  // the reader waits for the client's own goodbye, the watch for the deadline
      co_return;
    } else {
      co_await wake_writer_.async_wait(into(ec));
    }
  }
}

Session::Steady::time_point Session::watch_until() const {
  auto until = Steady::now() + idle_watch;
  if (finishing_) until = std::min(until, finish_by_);
  if (!finishing_ && !clock_.stepped()) until = std::min(until, clock_.timer_at(dialogue_->next_tick()));
  return until;
}

asio::awaitable<void> Session::watch() {
  const auto self = shared_from_this();
  while (!over_) {
    wake_watch_.expires_at(watch_until());
    error_code ec;
    co_await wake_watch_.async_wait(into(ec));
    if (over_) co_return;
    const auto now = Steady::now();
    if (finishing_ && now >= finish_by_) {
      if (!said_goodbye_) reset("did not take its last message in time");
      over(why_);
    } else if (writing_ && now - progress_at_ > setup_.limits.stall) {
      reset("took no byte for " + std::to_string(setup_.limits.stall.count()) + " ms");
    } else if (!finishing_ && is_silent(now)) {
      finish("silent for " + std::to_string(dialogue_->longest_silence()->count() / 1000) + " s");
    } else if (!finishing_ && !clock_.stepped()) {
      tick(clock_.lived());
    }
  }
}

/// Not one whose bytes wait to be read: it may be us who were stopped for a while.
bool Session::is_silent(Steady::time_point now) const {
  const auto longest = dialogue_->longest_silence();
  error_code ec;
  return longest && now - heard_at_ > *longest && socket_.available(ec) == 0;
}

void Session::tick(Time now) {
  if (over_ || finishing_ || now < dialogue_->next_tick()) return;
  handle(dialogue_->on_tick(now));
  not_before_ = now + shortest_rhythm;
}

/// A dialogue that would be ticked at the same moment for ever must not hold up time: only its client's words bring that about.
std::optional<Time> Session::next_tick() const {
  if (over_ || finishing_) return std::nullopt;
  return std::max(dialogue_->next_tick(), not_before_);
}

std::optional<Time> Session::next_wish() const {
  const auto wish = over_ || finishing_ ? std::nullopt : dialogue_->next_wish();
  return wish ? std::optional(std::max(*wish, not_before_)) : std::nullopt;
}

std::vector<protocol::Event> Session::push_ping(const std::shared_ptr<const protocol::Bytes>& bytes, const PingRequest& ping,
                                                protocol::BytesView made_with, Time now) {
  if (over_ || finishing_) return {};
  protocol::Delivery delivery = dialogue_->on_ping(made_with, bytes->size(), now);
  if (!delivery.prefixes.empty()) {
    const bool as_it_is = delivery.prefixes.size() == 1 && delivery.prefixes.front().empty();
    outbox_.push_ping(bytes, static_cast<std::uint32_t>(ping.number),
                      as_it_is ? std::vector<protocol::Bytes>{} : std::move(delivery.prefixes), ping.fired_at);
    wake_writer_.cancel();
  }
  return std::move(delivery.events);
}

void Session::finish(std::string why) {
  if (over_ || finishing_) return;
  finishing_ = true;
  why_ = std::move(why);
  finish_by_ = Steady::now() + finish_limit;
  outbox_.drop_waiting_pings(DropReason::stop);
  wake_reader_.cancel();
  wake_writer_.cancel();
  wake_watch_.cancel();
}

void Session::reset(std::string why) {
  if (over_) return;
  error_code ec;
  socket_.set_option(asio::socket_base::linger(true, 0), ec);
  over(std::move(why));
}

void Session::over(std::string why) {
  if (std::exchange(over_, true)) return;
  error_code ec;
  socket_.close(ec);
  outbox_.end(finishing_ ? DropReason::stop : DropReason::gone);
  wake_reader_.cancel();
  wake_writer_.cancel();
  wake_watch_.cancel();
  parent_.on_over(*this, why);
}

}  // namespace sonar
