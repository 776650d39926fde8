#include "daemon/sonars/observers.hpp"

#include "daemon/sonars/device.hpp"
#include "daemon/system/listen.hpp"

namespace sonar {
namespace {
constexpr auto accept_pause = std::chrono::milliseconds(100);
}

Observers::Observers(DeviceContext& context, const SonarConfig& config, Converse converse)
    : context_(context), config_(config), converse_(std::move(converse)), acceptor_(context.io) {}

Observers::~Observers() = default;

Result<void> Observers::open() {
  if (config_.max_observers == 0) return {};
  Endpoint at{config_.bind_ip, config_.observer_port};
  if (auto r = listen_tcp(acceptor_, at); !r)
    return failure(r.error().kind, r.error().text + "; observers: {port: 0} in the configuration takes any that is free");
  at.port = acceptor_.local_endpoint().port();
  at_ = at;
  return {};
}

void Observers::start() {
  if (acceptor_.is_open()) keep_accepting();
}

void Observers::stop(const std::string& why) {
  stopping_ = true;
  error_code ec;
  acceptor_.close(ec);
  const auto sessions = sessions_;  // finish() may end one at once and change the list
  for (const auto& s : sessions) s->finish(why);
}

void Observers::push_ping(const std::shared_ptr<const protocol::Bytes>& bytes, const PingRequest& ping,
                          protocol::BytesView made_with) {
  for (const auto& s : sessions_) s->push_ping(bytes, ping, made_with, context_.clock.lived());
}

void Observers::tick() {
  const auto sessions = sessions_;
  for (const auto& s : sessions) s->tick(context_.clock.lived());
}

void Observers::keep_accepting() {
  asio::co_spawn(
      context_.io, [this] { return accept(); },
      [this](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        say_fault(context_.log, faults_, text_of(fault), {"sonar", config_.name});
        keep_accepting();
      });
}

asio::awaitable<void> Observers::accept() {
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
    const bool spare = context_.admission.leaves_spare(socket, Admission::Purpose::client);
    if (spare && sessions_.size() < static_cast<std::size_t>(config_.max_observers)) {
      admit(std::move(socket));
    } else {
      if (spare) say("observer turned away: " + std::to_string(config_.max_observers) + " look on already", nullptr);
      close_politely(socket);
    }
  }
}

void Observers::admit(tcp::socket socket) {
  const Session::Setup setup{config_.outbox, false, ++ever_, context_.config.limits, {}};
  auto session = std::make_shared<Session>(*this, context_.clock, std::move(socket), converse_(), setup);
  say("observer connected", session.get());
  sessions_.push_back(session);
  session->start();
}

void Observers::say(const std::string& what, const Session* of) {
  std::vector<LogField> fields{{"sonar", config_.name}};
  if (of != nullptr) fields.emplace_back("observer", of->client());
  say_at_times(context_.log, visits_, LogLevel::info, what, std::move(fields));
}

/// Settings, triggers and addresses are for clients. Whoever sends them here may have meant the other port.
void Observers::on_event(Session& from, const protocol::Event& event) {
  if (std::holds_alternative<protocol::Notice>(event)) return;
  say_at_times(context_.log, ignored_, LogLevel::info, "request of an observer ignored: only clients change what a sonar does",
               {{"sonar", config_.name}, {"observer", from.client()}});
}

void Observers::on_fault(Session&, const std::string& what) { say_fault(context_.log, faults_, what, {"sonar", config_.name}); }

void Observers::on_over(Session& session, const std::string& why) {
  say("observer gone: " + why, &session);
  sessions_.remove_if([&session](const auto& s) { return s.get() == &session; });
  context_.on_change();
}

}  // namespace sonar
