// Makes room for the stacks of a program, because a stack that reaches its limit ends the program by a signal without a word.
#pragma once

#include <cstddef>

#include "core/base/result.hpp"

namespace sonar {

constexpr std::size_t usual_stack_bytes = std::size_t{8} << 20;  // the limit that systems set

/// Raises the limit of the main thread's stack to the usual size, as far as the hard limit permits, and gives new threads the
/// usual size. Call it first in main(). Error: unavailable if the hard limit leaves too little.
Result<void> make_room_for_stacks();

}  // namespace sonar
