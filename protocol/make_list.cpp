// This function has a file of its own, because a program that adds a make defines makes() in its place
// (tests/example_make/makes.cpp).
#include "protocol/host.hpp"

namespace sonar::protocol {

std::span<const Make> makes() {
  static const std::vector<Make> all = product_makes();
  return all;
}

}  // namespace sonar::protocol
