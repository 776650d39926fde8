// Prints the makes and their products for makes_text.py, a line for each make: "a BlueView sonar: blueview-p900-90 ...".
// With --demos it prints the name of each make's demo instead.
#include <cstdio>
#include <string>
#include <string_view>

#include "protocol/host.hpp"

int main(int argc, char** argv) {
  const bool demos = argc > 1 && std::string_view(argv[1]) == "--demos";
  for (const sonar::protocol::Make& make : sonar::protocol::makes()) {
    std::string line = demos ? std::string(make.name_in_demo()) : std::string(make.title) + ":";
    for (const auto& model : make.device->models())
      if (!demos) line.append(" ").append(model->profile);
    std::puts(line.c_str());
  }
  return 0;
}
