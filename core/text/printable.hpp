// Makes text from outside printable on a terminal: bytes that move the cursor, change the terminal's state or are not
// UTF-8 become \xNN.
#pragma once

#include <string>
#include <string_view>

namespace sonar::text {

std::string printable(std::string_view text);

}  // namespace sonar::text
