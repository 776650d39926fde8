// What the terminal can show, and taking it over for a picture that is drawn again and again. Used by view.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/image/terminal_fan.hpp"

namespace sonar::clients {

/// What is known of standard output and its terminal; `variable` looks a name up in the environment.
struct TerminalFacts {
  bool is_terminal = false;
  std::function<std::optional<std::string>(const std::string& name)> variable;
};
TerminalFacts terminal_facts();

/// None for files and pipes, with NO_COLOR set (no-color.org), on dumb terminals and where the locale is not UTF-8; else what
/// COLORTERM says, or 256 colours.
TerminalColours choose_colours(const TerminalFacts& facts);

struct TerminalSize {
  int columns = 80, lines = 24;
};
/// COLUMNS and LINES of the environment, else the terminal's own, else 80 x 24.
TerminalSize terminal_size();

/// A screen of its own while it lives; what was there before comes back with the cursor. Does nothing when output is no terminal:
/// pictures then follow each other.
class LiveScreen {
 public:
  explicit LiveScreen(bool is_terminal);
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;
  /// False when nobody reads any more.
  bool show(const std::vector<std::string>& lines) const;

 private:
  bool is_terminal_;
};

}  // namespace sonar::clients
