// Finds sonars: sends "BVE?" datagrams and receives "BVE!" datagrams (docs/protocols/blueview-link.md, "Discovery"). Needs no
// thread: answers wait in the socket until they are read.
#pragma once

#include <string>
#include <vector>

#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/socket.hpp"

namespace sonar::bvt {

class DiscoveryAgent {
 public:
  /// Clears the results and asks again: by broadcast on every network, this machine's own among them, and every address in
  /// the environment variable BVE_DISCOVERY (separated by commas or spaces). failed without a socket.
  Code start();
  /// Takes the last answers.
  void stop();
  /// IPv4 addresses in the order they answered; asks once more when the last time was over a second ago.
  const std::vector<std::string>& sonars();

 private:
  void ask();
  void receive_answers();

  Descriptor socket_;
  Deadline last_asked_{};
  std::vector<std::string> found_;
};

}  // namespace sonar::bvt
