// Result<T>: a value or an error. It is the return type of functions that can fail for a cause outside the program. See
// docs/architecture.md, "Errors".
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace sonar {

/// Kinds of errors. Their values are the exit codes of the programs, as in sysexits.h.
enum class ErrorKind : int {
  usage = 64,     // wrong arguments of a command
  bad_data = 65,  // a damaged or invalid scene, mesh or recording
  missing_file = 66,
  unavailable = 69,  // a port, interface or device that cannot be used
  bug = 70,          // a mistake in sonard
  io = 74,
  config = 78
};

struct Error {
  ErrorKind kind = ErrorKind::bug;
  std::string text;  // one sentence: what failed, where, why, and the next step
};

template <class T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> failure(ErrorKind kind, std::string text) {
  return tl::unexpected<Error>(Error{kind, std::move(text)});
}
inline int exit_code(ErrorKind kind) { return static_cast<int>(kind); }

}  // namespace sonar
