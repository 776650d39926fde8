// Prints which fault takes effect on which make, as a Markdown table: `ninja -C build/release docs` writes it into the build
// folder.
#include <iostream>

#include "daemon/config/fault_support.hpp"

int main() {
  std::cout << "# Faults: what takes effect where\n\n" << sonar::support_table();
  return std::cout.flush() ? 0 : 1;
}
