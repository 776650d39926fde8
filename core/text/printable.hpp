// Makes text from outside printable on a terminal. Bytes that are not UTF-8, move the cursor or change the terminal's state
// become \xNN.
#pragma once

#include <string>
#include <string_view>

namespace sonar::text {

std::string printable(std::string_view text);

}  // namespace sonar::text
