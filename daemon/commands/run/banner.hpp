// Lines that sonard prints on stderr when it is ready and when it ends.
#pragma once

#include <string>

#include "daemon/server/app.hpp"

namespace sonar {

struct BannerFacts {
  std::string config_line;  // where the configuration came from
  double scene_ms = 0;      // time to load the scene and build the engine
};
std::string banner(const App& app, const BannerFacts& facts);
std::string ready_line(const App& app, double seconds);
/// One line per sonar, and the memory: "sonar front  20 pings  0 dropped  0 late ticks ...".
std::string summary(const App& app);
/// One line per client stream.
std::string digest_lines(const App& app);

}  // namespace sonar
