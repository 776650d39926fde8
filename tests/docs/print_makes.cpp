// Prints the makes and their products for makes_text.py, a line for each make: "a BlueView sonar: blueview-p900-90 ...".
#include <cstdio>
#include <string>

#include "protocol/host.hpp"

int main() {
  for (const sonar::protocol::Make& make : sonar::protocol::makes()) {
    std::string line = std::string(make.title) + ":";
    for (const auto& model : make.device->models()) line.append(" ").append(model->profile);
    std::puts(line.c_str());
  }
  return 0;
}
