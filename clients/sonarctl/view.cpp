#include <cstdio>

#include "clients/sonarctl/ping_log.hpp"
#include "clients/sonarctl/source.hpp"
#include "clients/sonarctl/terminal.hpp"
#include "clients/sonarctl/waiting.hpp"
#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

using Clock = std::chrono::steady_clock;

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

Result<void> check(const ViewOptions& o) {
  if (o.png.empty() && !o.terminal)
    return failure(ErrorKind::usage, "choose an output: --png FILE, or --term, which is usual on a terminal");
  if (o.live && !o.source.recording.empty())
    return failure(ErrorKind::usage, "--live is for devices; choose a ping of a recording with --ping");
  if (o.pings > 0 && !o.live) return failure(ErrorKind::usage, "--pings needs --live");
  return check_output(o.source, o.png);
}

Result<Raster> write_picture(const ViewOptions& options, PicturePainter& painter, const SonarPicture& picture) {
  Result<Raster> raster = painter.draw(picture);
  if (!raster) return raster;
  if (Result<void> written = write_png(*raster, options.png); !written) return tl::unexpected(written.error());
  return raster;
}

/// Returns the picture as lines that fit into the terminal above `lines_kept` other lines.
Result<std::vector<std::string>> lines_of(const ViewOptions& options, const SonarPicture& picture, int lines_kept) {
  const TerminalSize size = terminal_size();
  TerminalStyle style;
  style.columns = size.columns;
  style.lines = size.lines - lines_kept;
  style.colours = options.colours.value_or(choose_colours(terminal_facts()));
  style.map = options.style.colours;
  style.labels = options.style.rings;
  return draw_terminal_picture(picture, style);
}

std::string size_of(const SonarPicture& picture) {
  const std::string cells = text::format("%zu rows x %zu beams", picture.image.rows, picture.image.beams);
  if (picture.kind != PictureKind::points) return cells;
  const std::string points = text::format("%zu points", picture.points.size());
  return picture.column == SonarPicture::Column::none ? points : points + ", " + cells;
}

/// Adds a note to an empty picture, because it could be mistaken for a failure.
std::string caption_of(std::string text, const SonarPicture& picture) {
  return picture.nothing_detected() ? text + text::format("  nothing detected within %g m", picture.range_m()) : text;
}

Result<void> view_one(const ViewOptions& options) {
  const Result<HostPing> ping = fetch_ping(options.source, options.ping);
  if (!ping) return tl::unexpected(ping.error());
  const Result<SonarPicture> picture = protocol::drawing_of(*ping);
  if (!picture) return tl::unexpected(picture.error());
  if (!options.png.empty()) {
    PicturePainter painter(options.style);
    const Result<Raster> raster = write_picture(options, painter, *picture);
    if (!raster) return tl::unexpected(raster.error());
    const std::string kind = picture->kind == PictureKind::fan ? "" : ", " + std::string(name_of(picture->kind));
    std::printf("%s: %d x %d pixels, %s, %.2f m%s\n", options.png.c_str(), raster->width, raster->height,
                size_of(*picture).c_str(), picture->range_m(), caption_of(kind, *picture).c_str());
  }
  if (!options.terminal) return {};
  const auto lines = lines_of(options, *picture, 2);
  if (!lines) return tl::unexpected(lines.error());
  for (const std::string& line : *lines) std::puts(line.c_str());
  ViewCaption caption("");  // one ping has no rate
  caption.add(*ping, std::nullopt, 0);
  std::puts(caption_of(caption.text(), *picture).c_str());
  return {};
}

class LiveView {
  static constexpr std::size_t most_notices = 20;

 public:
  LiveView(const ViewOptions& options, OpenedStream opened)
      : options_(options),
        waits_(options.source, opened.stream, opened.observes),
        opened_(std::move(opened)),
        painter_(options.style),
        figures_(opened_->stream.make().rate_unit()) {}

  /// Shows pings until it is interrupted, the requested pings were shown, or the output is closed. A run without limits connects
  /// again if the device has disconnected.
  Result<void> run() {
    const bool has_screen = options_.terminal && terminal_facts().is_terminal;
    Result<void> ran;
    {
      const LiveScreen screen(has_screen);
      for (;;) {
        ran = draw(screen, has_screen);
        if (!lost_ || interrupted != 0 || options_.pings > 0 || figures_.pings() == 0) break;
        const Endpoint device = opened_->again;
        outage_.begins(opened_->stream);
        opened_.reset();  // frees its ports for the next connection
        auto again = open_again(options_.source, device, outage_, ran.error(), [&](const std::string& line) {
          if (has_screen)
            static_cast<void>(screen.show({line}));
          else
            print_notices({line});
        });
        if (!again) {
          ran = tl::unexpected(again.error());
          break;
        }
        opened_.emplace(*std::move(again));
        lost_ = false;
      }
    }
    if (interrupted != 0) ran = {};
    print_notices(notices_);  // printed now, because the screen would have hidden the notices
    print_notices(notice_log_.rest());
    return ran;
  }

 private:
  Result<void> draw(const LiveScreen& screen, bool has_screen) {
    Silence quiet(options_.source, *opened_);
    bool received = !opened_->stream.host().counts();  // without counts, only pings give items
    while (interrupted == 0 && (options_.pings == 0 || figures_.pings() < options_.pings)) {
      PingStream::Item item = opened_->stream.next(waits_.patience(std::chrono::milliseconds(500)));
      waits_.look(item.ping.has_value());
      lost_ = item.what == Wait::closed || (item.what != Wait::data && quiet.is_over());
      if (item.what == Wait::closed) return tl::unexpected(closed(item, figures_.pings()));
      if (item.what == Wait::data) quiet.ends();
      received = received || item.what == Wait::data;
      item.notices = notice_log_.kept(item.notices);
      if (!has_screen) print_notices(item.notices);
      for (std::string& notice : item.notices)
        if (has_screen && notices_.size() < most_notices) notices_.push_back(std::move(notice));
      if (lost_)
        return tl::unexpected(silence(options_.source, *opened_, received, "nothing more", "is the daemon stopped or stuck?"));
      if (!item.ping) continue;
      const Result<bool> read = show(*item.ping, screen);
      if (!read) return tl::unexpected(read.error());
      if (!*read) break;
    }
    return {};
  }

  /// Returns false if the output was closed.
  Result<bool> show(const HostPing& ping, const LiveScreen& screen) {
    figures_.add(ping, opened_->stream.host().counts(), now_s());
    outage_.ends();
    const Result<SonarPicture> picture = protocol::drawing_of(ping);
    if (!picture) return tl::unexpected(picture.error());
    if (!options_.png.empty())
      if (const Result<Raster> drawn = write_picture(options_, painter_, *picture); !drawn) return tl::unexpected(drawn.error());
    if (!options_.terminal) {
      const bool overwrites = terminal_facts().is_terminal;  // one line that changes, or one line per ping
      std::printf(overwrites ? "\r\x1b[K%s  %s" : "%s  %s\n", options_.png.c_str(),
                  caption_of(figures_.text(), *picture).c_str());
      return std::fflush(stdout) == 0;
    }
    auto lines = lines_of(options_, *picture, 1);
    if (!lines) return tl::unexpected(lines.error());
    lines->push_back(caption_of(figures_.text(), *picture));
    return screen.show(*lines);
  }

  const ViewOptions& options_;
  FirstPingWait waits_;
  std::optional<OpenedStream> opened_;
  PicturePainter painter_;
  ViewCaption figures_;
  NoticeLog notice_log_;
  std::vector<std::string> notices_;
  bool lost_ = false;  // the device is gone, or silent
  Outage outage_;
};

Result<void> view_live(const ViewOptions& options) {
  auto opened = connect(options.source, false);
  if (!opened) return tl::unexpected(opened.error());
  const Result<void> ran = LiveView(options, *std::move(opened)).run();
  if (!options.terminal && terminal_facts().is_terminal) std::puts("");
  return ran;
}

}  // namespace

Result<void> view(ViewOptions options) {
  options.terminal = options.terminal || (options.png.empty() && terminal_facts().is_terminal);
  if (Result<void> sound = check(options); !sound) return sound;
  return options.live ? view_live(options) : view_one(options);
}

}  // namespace sonar::clients
