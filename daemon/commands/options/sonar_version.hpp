// The program's version, for files that it leaves behind; set by the build.
#pragma once

namespace sonar::render {

inline constexpr const char* version = SONARD_VERSION;

}  // namespace sonar::render
