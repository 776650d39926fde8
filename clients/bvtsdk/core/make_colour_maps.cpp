// Writes the colour maps into a folder, each as NAME.cmap. The build runs it.
#include <cstdio>
#include <filesystem>

#include "clients/bvtsdk/core/colour_maps.hpp"

int main(int argc, char** argv) {
  using namespace sonar::bvt;
  if (argc != 2) {
    std::fputs("usage: make_colour_maps FOLDER\n", stderr);
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::error_code ignored;  // if the folder cannot be created, save_colour_map() fails
  std::filesystem::create_directories(folder, ignored);
  for (const std::string_view name : colour_map_names) {
    const std::filesystem::path path = folder / (std::string(name) + ".cmap");
    if (save_colour_map(path.string(), make_colour_map(name)) == success) continue;
    std::fprintf(stderr, "%s cannot be written; is the folder writable?\n", path.c_str());
    return 1;
  }
  return 0;
}
