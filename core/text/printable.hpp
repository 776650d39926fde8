// Makes text from outside printable on a terminal: bytes that would move the cursor, change the terminal's state or are no UTF-8
// are shown as \xNN.
#pragma once

#include <string>
#include <string_view>

namespace sonar::text {

std::string printable(std::string_view text);

}  // namespace sonar::text
