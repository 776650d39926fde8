// Capabilities of the terminal, and a full-screen picture that is redrawn. Used by view.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

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
/// COLUMNS and LINES of the environment, else the terminal's own, else 80 x 24.
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

}  // namespace sonar::clients
