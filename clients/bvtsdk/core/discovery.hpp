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
  /// Clears the results and sends the question again: by broadcast on every network and on loopback, and to every address in the
  /// environment variable BVE_DISCOVERY (separated by commas or spaces). Returns failed if there is no socket.
  Code start();
  /// Reads the answers that have arrived, and closes the socket.
  void stop();
  /// Returns the IPv4 addresses in the order of their answers. Sends the question again if the last one was over a second ago.
  const std::vector<std::string>& sonars();

 private:
  void ask();
  void receive_answers();

  Descriptor socket_;
  Deadline last_asked_{};
  std::vector<std::string> found_;
};

}  // namespace sonar::bvt
