#include "clients/sonarctl/terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>

#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

std::optional<int> positive_number(const std::optional<std::string>& text) {
  int value = 0;
  if (!text) return std::nullopt;
  const auto [stop, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (error != std::errc{} || stop != text->data() + text->size() || value <= 0) return std::nullopt;
  return value;
}

bool says_utf8(std::string locale) {
  std::transform(locale.begin(), locale.end(), locale.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return locale.find("utf-8") != std::string::npos || locale.find("utf8") != std::string::npos;
}

}  // namespace

TerminalFacts terminal_facts() {
  return {::isatty(STDOUT_FILENO) == 1, [](const std::string& name) -> std::optional<std::string> {
            const char* value = std::getenv(name.c_str());
            return value != nullptr ? std::optional<std::string>(value) : std::nullopt;
          }};
}

TerminalColours choose_colours(const TerminalFacts& facts) {
  const std::string term = facts.variable("TERM").value_or("");
  if (!facts.is_terminal || !facts.variable("NO_COLOR").value_or("").empty() || term.empty() || term == "dumb")
    return TerminalColours::none;
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {  // the first one set applies
    const std::string locale = facts.variable(name).value_or("");
    if (locale.empty()) continue;
    if (!says_utf8(locale)) return TerminalColours::none;
    break;
  }
  const std::string depth = facts.variable("COLORTERM").value_or("");
  return depth == "truecolor" || depth == "24bit" ? TerminalColours::true_colour : TerminalColours::palette_256;
}

TerminalSize terminal_size() {
  TerminalSize size;
  winsize window{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0 && window.ws_row > 0)
    size = {window.ws_col, window.ws_row};
  const TerminalFacts facts = terminal_facts();
  size.columns = positive_number(facts.variable("COLUMNS")).value_or(size.columns);
  size.lines = positive_number(facts.variable("LINES")).value_or(size.lines);
  return size;
}

LiveScreen::LiveScreen(bool is_terminal) : is_terminal_(is_terminal) {
  if (!is_terminal_) return;
  std::fputs("\x1b[?1049h\x1b[?25l\x1b[2J", stdout);  // alternate screen, no cursor, cleared
  std::fflush(stdout);
}

LiveScreen::~LiveScreen() {
  if (!is_terminal_) return;
  std::fputs("\x1b[0m\x1b[?25h\x1b[?1049l", stdout);
  std::fflush(stdout);
}

bool LiveScreen::show(const std::vector<std::string>& lines) const {
  std::string text = is_terminal_ ? "\x1b[H" : "";
  for (const std::string& line : lines) {
    if (is_terminal_ && &line != &lines.front()) text += "\r\n";
    text += line + (is_terminal_ ? "\x1b[K" : "\n");  // erases the rest of the previous line
  }
  if (is_terminal_) text += "\x1b[J";
  std::fputs(text.c_str(), stdout);
  return std::fflush(stdout) == 0;
}

void ViewCaption::add(const HostPing& ping, const std::optional<protocol::Host::Counts>& of_wire, Seconds at) {
  if (of_wire) missed_ = of_wire->missing_pings;
  arrivals_.push_back(at);
  if (arrivals_.size() > remembered) arrivals_.pop_front();
  ++pings_;
  const protocol::PingFacts& f = ping.facts;
  ping_text_ =
      text::format("ping %u  %.2f m  %.4g MHz  %u beams x %u rows", f.number, f.range_m, f.frequency_hz / 1e6, f.beams, f.rows);
}

std::string ViewCaption::text() const {
  std::string text = ping_text_;
  if (arrivals_.size() < 2) return text;
  const double rate_hz = static_cast<double>(arrivals_.size() - 1) / std::max(1e-9, arrivals_.back() - arrivals_.front());
  text += text::format("  %.1f ", rate_hz) + rate_unit_;
  if (!missed_) return text;
  return text + (*missed_ == 0 ? "  no gaps" : "  " + std::to_string(*missed_) + " missed");
}

}  // namespace sonar::clients
