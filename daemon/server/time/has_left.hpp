// The function with which a step of stepped time tests whether its client has left.
#pragma once

#include <functional>

namespace sonar {

/// Returns true once the client has closed its end of the connection, or half of it.
using HasLeft = std::function<bool()>;

}  // namespace sonar
