// A sonar's picture as lines of text for a terminal: coloured half blocks, each character showing two pixels, or letters if
// there are no colours. `sonarctl view --term` prints it.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/image/colour_map.hpp"
#include "core/image/draw_picture.hpp"

namespace sonar {

enum class TerminalColours {
  none,         // plain ASCII: brightness by letter
  palette_256,  // xterm's fixed colours
  true_colour,  // 24 bit
};

struct TerminalStyle {
  int columns = 80, lines = 24;  // available space; the picture keeps its shape and may be smaller
  TerminalColours colours = TerminalColours::none;
  ColourMap map;       // unused without colours
  bool labels = true;  // metres at the starboard edge
};

/// Lines without newline characters; each line restores the terminal's colours. Errors: as draw_fan, and less space than 24
/// columns and 8 lines.
Result<std::vector<std::string>> draw_terminal_picture(const SonarPicture& picture, const TerminalStyle& style);

/// Index of the nearest of xterm's colours 16 to 255.
int palette_index(Rgb colour);

}  // namespace sonar
