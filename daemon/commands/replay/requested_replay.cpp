#include "daemon/commands/replay/requested_replay.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "daemon/server/http/http_router.hpp"
#include "protocol/control/control.hpp"

namespace sonar {
namespace {

constexpr double same_direction_rad = 1e-4;  // the smallest step of a scanning head is about 10 times as large

double between(double a_rad, double b_rad) { return std::abs(std::remainder(a_rad - b_rad, 2 * std::numbers::pi)); }

}  // namespace

Result<void> PlayedPings::open(const std::string& file) {
  rewind();
  if (!ahead_) return failure(ErrorKind::bad_data, file + " holds no ping");
  if (!ahead_->part.head_rad) return {};
  for (std::size_t bytes = 0; ahead_; ahead_ = read()) {
    bytes += ahead_->bytes.size();
    if (bytes > most_scan_bytes)
      return failure(ErrorKind::bad_data, file + " holds more than " + std::to_string(most_scan_bytes >> 20) +
                                              " MB of scan lines: replay a shorter recording");
    const double head_rad = ahead_->part.head_rad.value_or(0);
    lines_.push_back({head_rad, {ahead_->at, {{ahead_->part.port, std::move(ahead_->bytes)}}}});
  }
  return {};
}

void PlayedPings::rewind() {
  reader_.rewind();
  splitter_ = nullptr;
  if (codec_.framing != nullptr)
    splitter_ = std::make_unique<recording::MessageSplitter>(recording::Origin::device, *codec_.framing);
  ahead_ = read();
}

/// Returns the next message that holds a ping or a part of one. A recorder may join or divide the packets of the sonar.
std::optional<PlayedPings::Part> PlayedPings::read() {
  while (true) {
    auto message = splitter_ ? splitter_->next() : std::nullopt;
    if (!message) {
      message = reader_.next();
      if (!message) return std::nullopt;
      if (message->from != recording::Origin::device) continue;
      if (splitter_ && message->by == recording::Carrier::stream) {
        splitter_->append(message->at, message->bytes);
        continue;
      }
    }
    if (const auto part = codec_.ping_part(message->bytes)) return Part{message->at, *part, std::move(message->bytes)};
  }
}

/// Reads the messages of a ping and returns the one with the most content. The messages of a ping come in order of content,
/// either growing or shrinking; a message that breaks the order begins the next ping.
recording::Bytes PlayedPings::take_richest() {
  recording::Bytes richest = std::move(ahead_->bytes);
  ahead_ = read();
  if (!ahead_ || codec_.is_richer(ahead_->bytes, richest)) {
    for (; ahead_ && codec_.is_richer(ahead_->bytes, richest); ahead_ = read()) richest = std::move(ahead_->bytes);
    return richest;
  }
  recording::Bytes last = richest;
  for (; ahead_ && codec_.is_richer(last, ahead_->bytes); ahead_ = read()) last = std::move(ahead_->bytes);
  return richest;
}

std::optional<PlayedPing> PlayedPings::next() {
  if (!ahead_) return std::nullopt;
  PlayedPing ping{ahead_->at, {}};
  if (codec_.is_richer != nullptr) {
    const std::uint16_t port = ahead_->part.port;
    ping.parts.emplace_back(port, take_richest());
    return ping;
  }
  const auto is_new_port = [&ping](std::uint16_t port) {
    return std::none_of(ping.parts.begin(), ping.parts.end(), [port](const auto& part) { return part.first == port; });
  };
  for (; ahead_ && is_new_port(ahead_->part.port); ahead_ = read())
    ping.parts.emplace_back(ahead_->part.port, std::move(ahead_->bytes));
  return ping;
}

const PlayedPing& PlayedPings::nearest(double head_rad) {
  double least = 4;
  for (const Line& line : lines_) least = std::min(least, between(line.head_rad, head_rad));
  const auto is_nearest = [&](const Line& line) { return between(line.head_rad, head_rad) <= least + same_direction_rad; };
  auto found = std::find_if(lines_.begin() + static_cast<std::ptrdiff_t>(after_), lines_.end(), is_nearest);
  if (found == lines_.end()) found = std::find_if(lines_.begin(), lines_.end(), is_nearest);
  after_ = static_cast<std::size_t>(found - lines_.begin()) + 1;
  return found->ping;
}

namespace {

/// Makes a configuration of a sonar at the origin of an empty world. It points ahead, so the yaw of a ping's sonar is that of its
/// head.
Config config_of(const ReplayDevice& device, const ReplayOptions& options) {
  Config config;
  config.vehicles.emplace_back().name = "recording";
  SonarConfig& sonar = config.sonars.emplace_back();
  sonar.name = device.vendor->name();
  const auto replayed = device.make->codec.replayed;
  sonar.profile = {device.vendor, replayed == nullptr ? device.state->model : replayed(*device.state->model)};
  sonar.bind_ip = sonar.advertise_ip = options.at.ip;
  sonar.device_id = static_cast<std::uint16_t>(device.serial == 0 ? 1 : device.serial);
  sonar.max_clients = device.vendor->default_max_clients();
  sonar.max_observers = 0;
  sonar.options = device.state->options;
  derive_addresses(sonar);
  return config;
}

std::optional<std::chrono::nanoseconds> interval_of(const recording::RecordingReader& reader, const ReplayOptions& options) {
  return reader.knows_times() ? std::nullopt : std::optional(nanoseconds_from(1 / options.rate_hz));
}

}  // namespace

RequestedReplay::RequestedReplay(asio::io_context& io, recording::RecordingReader& reader, const ReplayDevice& device,
                                 ReplayOptions options, Log& log)
    : io_(io),
      reader_(reader),
      codec_(device.make->codec),
      pings_(reader, codec_),
      options_(std::move(options)),
      log_(log),
      config_(config_of(device, options_)),
      world_({}, {{config_.vehicles.front().name, {}}}, {}, clock_.now()),
      admission_(config_.limits, log),
      network_{io, clock_, admission_, log},
      pace_(options_.speed, interval_of(reader, options_)),
      due_(io),
      signals_(io) {}

Result<void> RequestedReplay::open(const std::string& file) {
  if (Result<void> opened = pings_.open(file); !opened) return opened;
  if (const auto damage = reader_.damage()) log_.warning(damage->text);
  device_ = std::make_unique<Device>(network_, Sonar::Surroundings{config_, world_}, config_.sonars.front(), 0, *this);
  return device_->open();
}

void RequestedReplay::start() {
  device_->start();
  if (!options_.handle_signals) return;
  error_code ec;
  signals_.add(SIGINT, ec);
  signals_.add(SIGTERM, ec);
  signals_.async_wait([this](const error_code& failed, int) {
    if (failed || over_) return;
    stop();
    if (over_) return;
    signals_.async_wait([](const error_code& e, int) {
      if (!e) std::_Exit(EXIT_FAILURE);  // a second signal ends the program at once
    });
  });
}

void RequestedReplay::stop(const std::string& why) {
  if (std::exchange(stopping_, true)) return;
  due_.cancel();  // a waiting ping is completed at once, because the device ends only when no ping is in progress
  device_->stop(why);
  end_when_gone();
}

void RequestedReplay::end_when_gone() {
  if (!stopping_ || over_ || !device_->gone()) return;
  over_ = true;
  error_code ec;
  signals_.cancel(ec);
  if (options_.on_end) options_.on_end();
}

/// Stops the replay when the last ping was sent, and every client has received the messages.
void RequestedReplay::on_change() {
  if (device_ == nullptr) return;
  if (was_last_ && !stopping_ && device_->sonar().settled())
    asio::post(io_, [this] {
      if (was_last_) stop("recording served to its end");  // otherwise another client has connected
    });
  end_when_gone();
}

/// Rewinds the recording for the first client.
void RequestedReplay::on_client(const Device& of, const std::string&, bool connected, const std::string&) {
  if (!connected) return;
  ++clients_;
  if (of.sonar().connections().clients() > 1 || pings_.is_scan()) return;
  from_the_front_ = true;
  was_last_ = false;
}

/// Reads one ping at a time in `disk_`.
asio::awaitable<RequestedReplay::Read> RequestedReplay::read(bool from_the_front) {
  Read found;
  found.begins_again = from_the_front || (pings_.at_end() && options_.loop);
  if (found.begins_again) pings_.rewind();
  if (auto ping = pings_.next()) found.ping = *std::move(ping);
  found.is_last = pings_.at_end() && !options_.loop;
  co_return found;
}

/// Returns the ping for a request; the lines of a scan are in memory.
asio::awaitable<PlayedPing> RequestedReplay::ping_for(const PingRequest& request) {
  if (pings_.is_scan()) co_return pings_.nearest(rpy_from_quat(request.sonar_in_world.orientation).yaw_rad);
  Read found = co_await asio::co_spawn(disk_, read(std::exchange(from_the_front_, false)), asio::use_awaitable);
  if (found.begins_again) pace_.begin_again();
  was_last_ = found.is_last && !from_the_front_;  // false if the first client has connected meanwhile
  co_return std::move(found.ping);
}

asio::awaitable<Simulator::Outcome> RequestedReplay::outcome_for(PingRequest request) {
  PlayedPing ping = co_await ping_for(request);
  auto recorded = std::make_shared<PartsByPort>();
  for (auto& [port, message] : ping.parts)
    if (codec_.answer == nullptr)
      recorded->emplace_back(port, std::move(message));
    else
      for (recording::Bytes& one : codec_.answer(message, request.vendor_settings.get())) {
        const auto part = codec_.ping_part(one);  // an answer may be for another port than the recorded message
        recorded->emplace_back(part ? part->port : port, std::move(one));
      }
  Simulator::Outcome outcome;
  outcome.recorded = std::move(recorded);
  auto made = std::make_shared<Ping>();
  made->request = std::move(request);
  outcome.ping = std::move(made);
  const auto now = ReplayPace::Steady::now();
  due_.expires_at(pings_.is_scan() || outcome.recorded->empty() || stopping_ ? now : pace_.due(ping.at, now));
  error_code ec;
  co_await due_.async_wait(into(ec));
  co_return outcome;
}

void RequestedReplay::compute(const Device&, PingRequest request, Simulator::Done done) {
  asio::co_spawn(io_, outcome_for(std::move(request)),
                 [done = std::move(done)](const std::exception_ptr& fault, Simulator::Outcome outcome) {
                   if (fault) outcome.failure = text_of(fault);  // an outcome without a ping
                   done(std::move(outcome));
                 });
}

void RequestedReplay::on_engine_failure(const Error& why) {
  outcome_ = tl::make_unexpected(why);
  asio::post(io_, [this] { stop("the recording cannot be read"); });
}

ReplayServer::Figures RequestedReplay::figures() const {
  const DeviceFigures of = device_->figures();
  ReplayServer::Figures figures;
  figures.clients = clients_;
  figures.refused = of.refused_clients;
  figures.messages = of.served;
  figures.bytes = of.bytes_written;
  return figures;
}

std::string RequestedReplay::at() const {
  return text::joined(device_->addresses(), ", ", [](const protocol::DriverAddress& address) {
    return std::string(address.protocol) + " " + text_of(address.at);
  });
}

ReplayPage::ReplayPage(asio::io_context& io, const LimitConfig& limits, Admission& admission, Log& log, PlayedRecording of)
    : limits_(limits),
      of_(std::move(of)),
      services_{io, limits, admission, log, "page"},
      views_(io, log),
      listener_(services_, "http", [this](tcp::socket socket, const Sender& sender) {
        return std::make_shared<HttpConnection>(services_, *this, std::move(socket), sender);
      }) {}

asio::awaitable<HttpOutcome> ReplayPage::answer(const HttpRequest& request, HttpConnection& from) {
  RoutedRequest routed = route_request(request, {services_.token, from.reached().ip, access_.hosts});
  if (auto* const answer = std::get_if<HttpAnswer>(&routed.action)) co_return std::move(*answer);
  if (const auto* const asked = std::get_if<SocketAction>(&routed.action)) {
    auto opened =
        open_view(request, asked->query, {services_.token, secrets_, from.reached().ip, access_}, ViewSecrets::Steady::now());
    if (auto* const answer = std::get_if<HttpAnswer>(&opened)) co_return std::move(*answer);
    if (views_.count() >= limits_.viewers || !from.claim_slot())
      co_return answer_of(503, control::StatusCode::failed, "all slots of viewers are in use");
    co_return views_.open(services_, from, request, std::get<ViewWelcome>(opened), of_);
  }
  if (std::holds_alternative<HelpAction>(routed.action))
    co_return HttpAnswer{200, "sonard replay: open this address in a browser\n", "text/plain"};
  if (std::holds_alternative<HealthAction>(routed.action))
    co_return HttpAnswer{200, std::string(control::health_of_replay) + of_.file.filename().string() + "\n", "text/plain"};
  co_return answer_of(404, control::StatusCode::unsupported, "sonard replay serves only its page");
}

HttpAnswer ReplayPage::refusal(const HttpRefusal& refusal) const {
  return answer_of(refusal.status, refusal.status == 503 ? control::StatusCode::failed : control::StatusCode::refused,
                   refusal.why);
}

}  // namespace sonar
