// usage: in_own_network PROGRAM [ARGUMENTS...]: runs it in a network of its own.
#include <unistd.h>

#include <cstdio>

#include "tests/own_network/own_network.hpp"

int main(int count, char** arguments) {
  if (count < 2) {
    std::fputs("usage: in_own_network PROGRAM [ARGUMENTS...]\n", stderr);
    return 64;
  }
  sonar::tests::enter_own_network();
  execvp(arguments[1], arguments + 1);
  std::perror(arguments[1]);
  return 69;
}
