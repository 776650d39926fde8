// Capabilities of the terminal, and a full-screen picture that is redrawn. `sonarctl view` uses them.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/sonarctl/ping_log.hpp"
#include "core/image/terminal_fan.hpp"

namespace sonar::clients {

/// Facts about standard output and its terminal; `variable` reads the environment.
struct TerminalFacts {
  bool is_terminal = false;
  std::function<std::optional<std::string>(const std::string& name)> variable;
};
TerminalFacts terminal_facts();

/// Returns no colours for files and pipes, with NO_COLOR (no-color.org), on dumb terminals and without a UTF-8 locale; else those
/// of COLORTERM, or 256 colours.
TerminalColours choose_colours(const TerminalFacts& facts);

struct TerminalSize {
  int columns = 80, lines = 24;
};
/// Returns COLUMNS and LINES of the environment, else the terminal's own size, else 80 x 24.
TerminalSize terminal_size();

/// Uses the alternate screen during its lifetime; the destructor restores the previous content and the cursor. If output is not
/// a terminal, pictures are printed one after the other.
class LiveScreen {
 public:
  explicit LiveScreen(bool is_terminal);
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;
  /// Returns false if the output was closed.
  bool show(const std::vector<std::string>& lines) const;

 private:
  bool is_terminal_;
};

// Makes the line under a picture: ping number, geometry, rate and number of missed pings.

class ViewCaption {
 public:
  /// `rate_unit`: that of the sonar's make.
  explicit ViewCaption(std::string_view rate_unit) : rate_unit_(rate_unit) {}
  /// `of_wire`: counts of the host after the ping, if it has any.
  void add(const HostPing& ping, const std::optional<protocol::Host::Counts>& of_wire, Seconds at);
  std::uint64_t pings() const { return pings_; }
  /// Returns "ping 123 10.00 m 2.1 MHz 512 beams x 437 rows 10.0 Hz no gaps"; rate and gaps from the second ping on.
  std::string text() const;

 private:
  static constexpr std::size_t remembered = 20;  // arrivals that determine the rate
  std::string rate_unit_;
  std::optional<std::uint64_t> missed_;
  std::deque<Seconds> arrivals_;
  std::uint64_t pings_ = 0;
  std::string ping_text_;
};

}  // namespace sonar::clients
