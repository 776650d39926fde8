#include <algorithm>
#include <chrono>
#include <cstdio>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/ping_log.hpp"
#include "clients/sonarctl/source.hpp"
#include "clients/sonarctl/waiting.hpp"
#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

using Clock = std::chrono::steady_clock;

/// Returns the time until the end of the run or of the permitted silence, at most 0.5 s, so that Ctrl-C is noticed soon.
std::chrono::milliseconds patience(const ListenOptions& options, double elapsed_s, double left_s) {
  if (options.seconds > 0) left_s = std::min(left_s, options.seconds - elapsed_s);
  return milliseconds_from(std::clamp(left_s, 0.0, 0.5));
}

class Listener {
 public:
  Listener(const ListenOptions& options, OpenedStream opened)
      : options_(options), start_(opened.connected_at), waits_(options.source, opened.stream, opened.observes) {
    use(std::move(opened));
  }

  /// Runs until the requested time or number of pings. It is an error if the device stops earlier or, in a run without a limit,
  /// does not come back.
  Result<void> run() {
    const Result<void> ran = run_until_end();
    print_notices(notices_.rest());
    return ran;
  }

  PingSummary summary() const { return log_.summary(counts()); }
  /// True if pings echo the sent settings.
  bool asked() const { return asked_; }
  std::string_view rate_unit() const { return rate_unit_; }
  const std::optional<HostPing>& last_ping() const { return last_ping_; }
  std::optional<double> first_ping_after_s() const { return first_ping_after_s_; }

 private:
  Result<void> run_until_end() {
    for (;;) {
      const Result<void> ran = run_once();
      if (ran || interrupted != 0 || log_.counts().pings == 0 || options_.seconds > 0 || options_.pings > 0 ||
          !options_.record.empty())
        return ran;
      const Endpoint device = opened_->again;
      before_ = counts();
      outage_.begins(opened_->stream);
      opened_.reset();  // frees its ports for the next connection
      auto again =
          open_again(options_.source, device, outage_, ran.error(), [](const std::string& line) { print_notices({line}); });
      if (!again) return interrupted != 0 ? Result<void>{} : tl::unexpected(again.error());
      use(*std::move(again));
    }
  }

  void use(OpenedStream opened) {
    opened_.emplace(std::move(opened));
    silence_.emplace(options_.source, *opened_);
    received_ = !opened_->stream.host().counts();
    asked_ = opened_->stream.host().expects_echo();
    rate_unit_ = opened_->stream.make().rate_unit();
  }

  Result<void> run_once() {
    while (!finished()) {
      const PingStream::Item item =
          opened_->stream.next(waits_.patience(patience(options_, seconds_since(start_), silence_->left_s())));
      waits_.look(item.ping.has_value());
      if (item.what == Wait::closed) return tl::unexpected(closed(item, log_.counts().pings));
      if (item.what == Wait::data) {
        silence_->ends();
        received_ = true;
        print_notices(notices_.kept(item.notices));
        if (item.ping) handle_ping(*item.ping);
      } else if (silence_->is_over()) {
        return tl::unexpected(silence(options_.source, *opened_, received_, "nothing more",
                                      "drivers give up after 10 s; is the daemon stopped or stuck?"));
      }
    }
    return {};
  }

  /// Returns the summed counts of all connections so far.
  std::optional<protocol::Host::Counts> counts() const {
    if (!opened_) return before_;
    auto all = opened_->stream.host().counts();
    if (!all || !before_) return all;
    all->messages += before_->messages;
    all->dummies += before_->dummies;
    all->junk_bytes += before_->junk_bytes;
    all->missing_pings += before_->missing_pings;
    return all;
  }

  bool finished() const {
    const bool enough = options_.pings > 0 && log_.counts().pings >= options_.pings;
    const bool over = options_.seconds > 0 && seconds_since(start_) >= options_.seconds;
    return enough || over || interrupted != 0 || output_closed_;
  }

  void handle_ping(const HostPing& ping) {
    const double at_s = seconds_since(start_);
    if (!last_ping_) first_ping_after_s_ = first_ping_time();
    log_.add(ping, at_s);
    last_ping_ = ping;
    outage_.ends();
    if (options_.json && !options_.quiet) std::puts(json_from(ping, at_s).c_str());
    if (!options_.json && (!options_.quiet || !ping.errors.empty())) std::puts(line_from(ping).c_str());
    output_closed_ = std::fflush(stdout) != 0;
  }

  double first_ping_time() const {
    if (options_.started_at_unix_s <= 0) return seconds_since(start_);
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count() -
           options_.started_at_unix_s;
  }

  const ListenOptions& options_;
  std::optional<OpenedStream> opened_;
  std::optional<Silence> silence_;
  std::optional<protocol::Host::Counts> before_;  // counts of connections that are lost
  bool received_ = false, asked_ = false, output_closed_ = false;
  std::string_view rate_unit_;
  Outage outage_;
  PingLog log_;
  NoticeLog notices_;
  Clock::time_point start_;
  FirstPingWait waits_;
  std::optional<HostPing> last_ping_;
  std::optional<double> first_ping_after_s_;
};

Result<void> report(const ListenOptions& options, const Listener& listener) {
  const PingSummary summary = listener.summary();
  const bool asked = listener.asked();
  std::puts(options.json ? json_from(summary, asked).c_str() : text_from(summary, asked, listener.rate_unit()).c_str());
  if (listener.first_ping_after_s() && !options.json)
    std::printf("first ping after %.3f s%s\n", *listener.first_ping_after_s(),
                options.started_at_unix_s > 0 ? " from the daemon's start" : "");
  if (!options.png.empty() && listener.last_ping()) {
    const Result<PolarImage> image = listener.last_ping()->picture();
    if (!image) return tl::unexpected(image.error());
    const Result<Raster> fan = draw_fan(*image, options.style);
    if (!fan) return tl::unexpected(fan.error());
    if (Result<void> written = write_png(*fan, options.png); !written) return written;
    if (!options.json) std::printf("picture %s, %d x %d pixels\n", options.png.c_str(), fan->width, fan->height);
  }
  const std::vector<std::string> found = complaints(summary, asked);
  if (found.empty()) return {};
  return failure(ErrorKind::bad_data, text::joined(found, "; "));
}

}  // namespace

Result<void> listen(const ListenOptions& options) {
  auto opened = connect(options.source, !options.json);
  if (!opened) return tl::unexpected(opened.error());
  if (!options.record.empty())
    if (Result<void> recording = opened->stream.record_to(options.record); !recording) return recording;
  if (!options.json) std::printf("connected to %s\n", opened->stream.about().c_str());
  std::fflush(stdout);
  Listener listener(options, *std::move(opened));
  const Result<void> ran = listener.run();
  const Result<void> reported = report(options, listener);
  return ran ? reported : ran;
}

}  // namespace sonar::clients
