// The fan as text: positions of echoes, in letters and in colours, and the size of the picture.
#include "core/image/terminal_fan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/geometry.hpp"

namespace sonar {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Returns a fan of 60 degrees and 10 m. The nearest half is bright to port, the farthest half to starboard.
PolarImage two_patches() {
  PolarImage image;
  image.rows = 40;
  image.beams = 20;
  image.row_spacing_m = 0.25;
  for (std::size_t beam = 0; beam < image.beams; ++beam)
    image.azimuth_rad.push_back(rad_from_deg(30 - 60 * static_cast<double>(beam) / 19));
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = 0; beam < image.beams; ++beam)
      image.samples.push_back((row < 20 && beam < 10) || (row >= 20 && beam >= 10) ? 255.0f : 0.0f);
  return image;
}

TerminalStyle small(TerminalColours colours) { return {24, 8, colours, *find_colour_map("gray"), true}; }

TEST(TerminalFan, DrawsLettersAndMetres) {
  const auto lines = draw_terminal_picture({.image = two_patches()}, small(TerminalColours::none));
  ASSERT_TRUE(lines);
  EXPECT_THAT(*lines, ElementsAre("        =+=-.",          //
                                  "        @@@@@@*. 10 m",  //
                                  "        @@@@@@:8 m",     //
                                  "        @@@@%.6 m",      //
                                  "    :#@@  := 5 m",       //
                                  "     +@@    3 m",        //
                                  "      -@  1 m",          //
                                  "       :"));
}

TEST(TerminalFan, LeavesTheTerminalsColoursAsTheyWere) {
  for (const TerminalColours colours : {TerminalColours::palette_256, TerminalColours::true_colour}) {
    const auto lines = draw_terminal_picture({.image = two_patches()}, small(colours));
    ASSERT_TRUE(lines);
    for (const std::string& line : *lines) {
      const std::size_t last = line.rfind("\x1b[");
      if (last != std::string::npos) {
        EXPECT_EQ(line.substr(last, 4), "\x1b[0m") << line;
      }
      EXPECT_THAT(line, Not(HasSubstr("\n")));
    }
  }
}

TEST(TerminalFan, UsesTheEscapeCodesOfTheChosenColours) {
  const auto palette = draw_terminal_picture({.image = two_patches()}, small(TerminalColours::palette_256));
  const auto exact = draw_terminal_picture({.image = two_patches()}, small(TerminalColours::true_colour));
  std::string palette_text, exact_text;
  for (const std::string& line : *palette) palette_text += line;
  for (const std::string& line : *exact) exact_text += line;
  EXPECT_THAT(palette_text, HasSubstr("\x1b[38;5;231m")) << "white";
  EXPECT_THAT(palette_text, HasSubstr("\u2580"));
  EXPECT_THAT(exact_text, HasSubstr("\x1b[38;2;255;255;255m"));
  EXPECT_THAT(exact_text, Not(HasSubstr("38;5;")));
}

TEST(TerminalFan, FitsTheAvailableSpaceAndKeepsItsProportions) {
  for (const auto& [columns, rows] : {std::pair{80, 24}, {200, 30}, {30, 60}}) {
    TerminalStyle style = small(TerminalColours::none);
    style.columns = columns, style.lines = rows;
    const auto lines = draw_terminal_picture({.image = two_patches()}, style);
    ASSERT_TRUE(lines);
    EXPECT_LE(std::ssize(*lines), rows);
    std::size_t widest = 0;
    for (const std::string& line : *lines) widest = std::max(widest, line.size());
    EXPECT_LE(widest, static_cast<std::size_t>(columns));
    // The fan is 10 m high and 10 m wide at the far end. A cell is twice as high as it is wide.
    EXPECT_NEAR(static_cast<double>(widest) / static_cast<double>(lines->size()), 2.0, 0.6) << columns << " x " << rows;
  }
}

TEST(TerminalFan, RefusesTooFewColumnsAndEmptyImages) {
  TerminalStyle style = small(TerminalColours::none);
  style.columns = 10;
  const auto refused = draw_terminal_picture({.image = two_patches()}, style);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("10 columns and 8 lines"));
  EXPECT_FALSE(draw_terminal_picture({.image = PolarImage{}}, small(TerminalColours::none)));
}

TEST(TerminalFan, FindsTheNearestOfXtermsColours) {
  EXPECT_EQ(palette_index({0, 0, 0}), 16);
  EXPECT_EQ(palette_index({255, 255, 255}), 231);
  EXPECT_EQ(palette_index({255, 0, 0}), 196);
  EXPECT_EQ(palette_index({95, 135, 175}), 67);
  EXPECT_EQ(palette_index({18, 18, 18}), 233) << "the grey scale has finer steps than the colour cube";
}

}  // namespace
}  // namespace sonar
