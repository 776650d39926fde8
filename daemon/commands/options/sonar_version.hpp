// The version of sonard, for the files that it writes; the build sets it.
#pragma once

namespace sonar::render {

inline constexpr const char* version = SONARD_VERSION;

}  // namespace sonar::render
