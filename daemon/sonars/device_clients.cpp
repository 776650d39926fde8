// A Device's clients: who is let in, who waits, who is turned away, and what changes when one comes or goes.
#include <poll.h>

#include <array>
#include <cmath>

#include "daemon/sonars/device.hpp"

namespace sonar {
namespace {

constexpr auto accept_pause = std::chrono::milliseconds(100);  // after running out of file descriptors
constexpr std::size_t longest_queue = 16;
constexpr int most_turned_away_at_once = 16;

/// Also when what it sent is still unread: the end of the stream lies behind that.
bool has_left(tcp::socket& socket) {
  pollfd asked{socket.native_handle(), POLLRDHUP, 0};
  return ::poll(&asked, 1, 0) > 0;
}

}  // namespace

/// A mistake of ours, not of a client: it may cost that client its connection, never the others.
void Device::say_fault(const std::string& what) { sonar::say_fault(context_.log, faults_, what, {"sonar", config_.name}); }

void Device::on_fault(Session&, const std::string& what) { say_fault(what); }

void Device::keep_accepting() {
  asio::co_spawn(
      context_.io, [this] { return accept(); },
      [this](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        say_fault(text_of(fault));
        keep_accepting();
      });
}

asio::awaitable<void> Device::accept() {
  while (!stopping_) {
    error_code ec;
    tcp::socket socket = co_await acceptor_.async_accept(into(ec));
    if (stopping_) co_return;
    if (ec) {
      if (context_.admission.send_away(acceptor_, ec)) continue;
      asio::steady_timer pause(context_.io, accept_pause);
      co_await pause.async_wait(into(ec));
      continue;
    }
    if (auto place = context_.admission.enter(socket)) {
      admit(std::move(socket), std::move(place));
    } else {
      ++figures_.refused_clients;
      close_politely(socket);
    }
  }
}

void Device::admit(tcp::socket socket, Admission::Place place) {
  if (sessions_.size() < static_cast<std::size_t>(config_.max_clients)) return welcome(std::move(socket), std::move(place));
  if (config_.when_full == WhenClientsFull::take_over) {
    const SessionPointer oldest = sessions_.front();
    sessions_.pop_front();
    leaving_.push_back(oldest);
    oldest->finish("another client took over");
    if (sessions_.empty()) use_initial_settings();
    return welcome(std::move(socket), std::move(place));
  }
  forget_who_left();
  if (config_.when_full == WhenClientsFull::queue && queue_.size() < longest_queue) {
    visits_.say(VisitLog::Kind::waits, "client waits for a place", {{"waiting", queue_.size() + 1}});
    queue_.push_back({std::move(socket), std::move(place)});
    return;
  }
  ++figures_.refused_clients;
  visits_.say(VisitLog::Kind::turned_away, "client turned away: " + std::to_string(config_.max_clients) + " already connected",
              {});
  if (turning_away_ >= most_turned_away_at_once || stopping_) return;
  ++turning_away_;
  asio::co_spawn(
      context_.io,
      [this, s = std::move(socket), p = std::move(place)]() mutable { return turn_away(std::move(s), std::move(p)); },
      [this](std::exception_ptr fault) {
        if (fault) say_fault(text_of(fault));
        --turning_away_;
        context_.on_change();
      });
}

/// FIN and no byte. What the client has sent meanwhile is read away, or the kernel would answer it with RST.
asio::awaitable<void> Device::turn_away(tcp::socket socket, Admission::Place place) {
  error_code ec;
  socket.shutdown(tcp::socket::shutdown_send, ec);
  bool late = false;
  asio::steady_timer deadline(context_.io, std::chrono::seconds(1));
  deadline.async_wait([&socket, &late](const error_code& e) {
    if (e) return;
    late = true;  // a read that has just ended is past cancelling, and another would have no end
    socket.cancel();
  });
  std::array<std::byte, 1024> dustbin;
  for (int reads = 0; !ec && !late && reads < 64; ++reads) co_await socket.async_read_some(asio::buffer(dustbin), into(ec));
  deadline.cancel();
  // The handler above must be done with `socket` before this frame goes.
  co_await asio::post(context_.io, asio::use_awaitable);
  socket.close(ec);  // before its place is free
  place.reset();
}

void Device::forget_who_left() {
  const std::size_t left = std::erase_if(queue_, [](Waiting& waiting) { return has_left(waiting.socket); });
  for (std::size_t i = 0; i < left; ++i)
    visits_.say(VisitLog::Kind::gone, "client gone: it waited for a place", {{"waiting", queue_.size()}});
}

void Device::welcome(tcp::socket socket, Admission::Place place) {
  const Time now = context_.clock.now();
  Session::Setup setup{config_.outbox, context_.digest, ++figures_.clients, context_.config.limits, std::move(place)};
  update_state(now);
  auto session = std::make_shared<Session>(*this, context_.clock, std::move(socket),
                                           vendor_.converse(state_, context_.clock.lived()), setup);
  visits_.say(VisitLog::Kind::connected, "client connected", {{"client", session->client()}});
  tell_of_client(*session, true, {});
  sessions_.push_back(session);
  session->start();
  on_membership();
}

void Device::on_membership() {
  state_.connected_client = sessions_.empty() ? protocol::Ipv4{} : sessions_.front()->client_ip();
  const Time now = context_.clock.now();
  if (sessions_.empty()) use_initial_settings();
  if (wants_pings())
    pacer_.configure(settings_, now);
  else
    pacer_.stop();
  arm();
  context_.on_change();
}

void Device::on_over(Session& session, const std::string& why) {
  visits_.say(
      VisitLog::Kind::gone, "client gone: " + why,
      {{"client", session.client()}, {"pings", session.outbox().pings_written()}, {"dropped", session.outbox().pings_dropped()}});
  tell_of_client(session, false, why);
  keep_figures_of(session);
  if (context_.digest) digests_.push_back({session.number(), session.digest().size(), session.digest().hex()});
  const auto is_it = [&session](const SessionPointer& s) { return s.get() == &session; };
  leaving_.remove_if(is_it);
  if (sessions_.remove_if(is_it) == 0) return context_.on_change();
  forget_who_left();
  if (!stopping_ && !queue_.empty()) {
    Waiting next = std::move(queue_.front());
    queue_.pop_front();
    if (sessions_.empty()) use_initial_settings();
    welcome(std::move(next.socket), std::move(next.place));
  } else {
    on_membership();
  }
}

// ---- figures

namespace {

void add(DeviceFigures& f, const Session& s) {
  const Outbox& box = s.outbox();
  f.offered += box.pings_offered();
  f.sent += box.pings_written();
  f.dropped += box.pings_dropped();
  for (std::size_t why = 0; why < drop_reasons; ++why) f.dropped_by[why] += box.dropped_by_reason()[why];
  f.waiting += box.pings_waiting();
  f.bytes_written += s.bytes_written();
  f.bytes_read += s.bytes_read();
}

}  // namespace

void Device::on_written(Session&, const Outbox::Message& message) {
  if (message.ping != 0) {
    const Time now = context_.clock.now();
    figures_.latency.add(seconds(now - message.fired_at));
    if (message.ping > last_served_.ping) {
      if (last_served_.ping != 0)
        figures_.jitter.add(std::abs(seconds(now - last_served_.at) - seconds(message.fired_at - last_served_.tick)));
      last_served_ = {message.ping, message.fired_at, now};
      ++figures_.served;
    }
  }
  context_.on_change();
}

/// Of a session that ends: they stay when it is gone.
void Device::keep_figures_of(const Session& session) { add(figures_, session); }

DeviceFigures Device::figures() const {
  DeviceFigures f = figures_;
  f.ticks = pacer_.ticks();
  f.skipped = pacer_.skipped();
  f.skipped_ticks = f.skipped.total() + f.skipped_stale;
  f.clients_now = sessions_.size();
  f.clients_queued = queue_.size();
  for (const auto* list : {&sessions_, &leaving_})
    for (const SessionPointer& s : *list) add(f, *s);
  return f;
}

}  // namespace sonar
