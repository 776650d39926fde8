// Where decoded pings come from: a device's TCP stream with our settings sent to it, a recording of one, and the status
// datagrams that lead to a device. Shared by listen, view and stats.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/net.hpp"
#include "core/base/result.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::clients {

class PingStream {
 public:
  /// Connects and, when there are settings, sends them. `patience`: for the connection.
  static Result<PingStream> open(const Endpoint& device, std::optional<oculus::FireRequest> asked,
                                 std::chrono::milliseconds patience);

  struct Item {
    Wait what = Wait::timed_out;
    std::optional<oculus::Received> message;  // with Wait::data
    std::string error;
  };
  /// The next message, or what happened instead within `patience`.
  Item next(std::chrono::milliseconds patience);
  Result<void> ask_again();
  /// Also writes every received byte to this file.
  Result<void> record_to(const std::filesystem::path& file);
  std::uint64_t junk_bytes() const { return decoder_.skipped_bytes(); }

 private:
  PingStream(Socket socket, std::optional<oculus::FireRequest> asked) : socket_(std::move(socket)), asked_(std::move(asked)) {}

  Socket socket_;
  std::optional<oculus::FireRequest> asked_;
  oculus::Decoder decoder_;
  std::ofstream record_;
};

/// Every ping of a raw dump: messages back to back, exactly the bytes of the TCP stream.
Result<std::vector<oculus::DecodedPing>> read_recording(const std::filesystem::path& file);

/// Waits for the status broadcast of a device on UDP 52102; reports what real drivers would object to in `complaints`.
struct Discovered {
  oculus::StatusMessage status;
  Endpoint device;
  std::vector<std::string> complaints;
};
Result<Discovered> discover(std::chrono::milliseconds patience);

}  // namespace sonar::clients
