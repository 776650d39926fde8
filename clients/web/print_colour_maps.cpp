// Prints the colour maps of core/image/colour_map.cpp as a module of the page: name -> [[at, r, g, b], ...]. The build runs it.
#include <cstdio>

#include "core/image/colour_map.hpp"

int main() {
  std::puts("export const anchors = {");
  for (const sonar::ColourMap& map : sonar::colour_maps()) {
    std::printf("  %s: [", std::string(map.name).c_str());
    for (const auto& a : map.anchors)
      std::printf("[%.9g, %.9g, %.9g, %.9g], ", static_cast<double>(a.at), static_cast<double>(a.r), static_cast<double>(a.g),
                  static_cast<double>(a.b));
    std::puts("],");
  }
  std::puts("};");
  return std::ferror(stdout) != 0;
}
