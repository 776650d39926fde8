// This function has a separate file, because a program that adds a make replaces makes() (tests/example_make/makes.cpp).
#include "protocol/host.hpp"

namespace sonar::protocol {

std::span<const Make> makes() {
  static const std::vector<Make> all = product_makes();
  return all;
}

}  // namespace sonar::protocol
