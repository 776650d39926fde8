// Draws a sonar's picture as lines of text for a terminal. With colours, a character shows two pixels as half blocks; without
// colours, the density of ASCII characters shows the brightness. `sonarctl view --term` prints the lines.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/image/colour_map.hpp"
#include "core/image/draw_picture.hpp"

namespace sonar {

enum class TerminalColours {
  none,         // ASCII characters of different density
  palette_256,  // xterm's fixed colours
  true_colour,  // 24 bit
};

struct TerminalStyle {
  int columns = 80, lines = 24;  // available space; the picture keeps its proportions and may be smaller
  TerminalColours colours = TerminalColours::none;
  ColourMap map;       // unused without colours
  bool labels = true;  // ranges in metres at the starboard edge
};

/// Returns lines without newline characters; each line restores the terminal's colours. Errors: those of draw_fan, and usage for
/// fewer than 24 columns or 8 lines.
Result<std::vector<std::string>> draw_terminal_picture(const SonarPicture& picture, const TerminalStyle& style);

/// Index of the xterm colour, 16 to 255, that is nearest to this colour.
int palette_index(Rgb colour);

}  // namespace sonar
