// A sonar's picture as lines of text for a terminal: half blocks in colour, two picture points a character cell, or letters where
// there are no colours. Built on PicturePainter; sonarctl view --term prints it.
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
  int columns = 80, lines = 24;  // room for the picture; it keeps its shape and may take less
  TerminalColours colours = TerminalColours::none;
  ColourMap map;       // unused without colours
  bool labels = true;  // metres at the starboard edge
};

/// Lines without their newline, each leaving the terminal's colours as they were. Refuses what draw_fan refuses, and room for
/// less than 24 columns and 8 lines.
Result<std::vector<std::string>> draw_terminal_picture(const SonarPicture& picture, const TerminalStyle& style);

/// The nearest of xterm's colours 16 to 255.
int palette_index(Rgb colour);

}  // namespace sonar
