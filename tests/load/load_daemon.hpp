// A whole daemon in a thread of this process, with premade pings and the requested number of sonars, each on its own address.
// This header does not include Asio, so that the tests compile quickly.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/emulator/connections/outbox.hpp"

namespace sonar::load {

struct LoadSetup {
  int sonars = 1;
  std::string sonar_lines;  // further keys of every sonar: "    clients: {max: 4}\n"
  std::string more;         // further sections
};

class LoadDaemon {
 public:
  explicit LoadDaemon(const LoadSetup& setup);
  ~LoadDaemon();
  const std::string& address(std::size_t sonar = 0) const;
  /// Returns the address for poses and control: UDP 14770 and 14771, TCP 14770 (control stream), 14771 (JSON poses), 8088 (HTTP).
  const std::string& pose_address() const { return address(0); }
  int stop();
  /// Call it only after stop().
  DeviceFigures figures(std::size_t sonar = 0) const;
  std::string log_text() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace sonar::load
