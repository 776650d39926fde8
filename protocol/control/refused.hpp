// The errors with which readers of the control protocol refuse their input.
#pragma once

#include <string>
#include <utility>

#include "core/base/result.hpp"

namespace sonar::control {

inline tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::bad_data, std::move(text)); }

}  // namespace sonar::control
