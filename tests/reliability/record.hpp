// Stores the figure of a reliability test with its bound: one JSON file for each figure, in the folder that SONARD_RELIABILITY
// names. reliability_table.py makes the table of reliability from them; it contains the list of items.
#pragma once

#include <string>

namespace sonar::test {

struct ReliabilityFigure {
  std::string item;    // a key of ITEMS in reliability_table.py
  std::string figure;  // the measured figure, with units: "0.02 % of 57600"
  std::string bound;   // the promised bound: "at most 0.5 %"
  bool passed = false;
  std::string command;  // the command that measures it again, from the root of the tree
};

/// Writes the figure to FOLDER/ITEM.json, with date and machine, and replaces an older one. Without SONARD_RELIABILITY it
/// writes nothing. Returns false if the file cannot be written.
bool record_reliability(const ReliabilityFigure& figure);

}  // namespace sonar::test
