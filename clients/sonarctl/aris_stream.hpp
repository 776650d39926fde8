// A controller of an ARIS (docs/protocols/aris.md): commands over one blocking socket, frames at another. Used by ping_stream.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/any_ping.hpp"
#include "clients/sonarctl/blueview_stream.hpp"
#include "clients/sonarctl/net.hpp"
#include "core/base/result.hpp"

namespace sonar::clients {

class ArisStream {
 public:
  /// Asks for frames with these settings: range, rate and gain; nothing: with the settings that the sonar has.
  static Result<ArisStream> open(Socket commands, const std::optional<HeadRequest>& request);

  struct Item {
    Wait what = Wait::timed_out;
    std::optional<ArisPing> ping;  // with Wait::data
    std::string error;
  };
  Item next(std::chrono::milliseconds patience);
  /// True when the sonar closes the connection within `patience`: it serves another controller.
  bool is_rejected(std::chrono::milliseconds patience) const { return ends_without_a_byte(commands_, patience); }

 private:
  using Clock = std::chrono::steady_clock;
  ArisStream(Socket commands, Socket frames) : commands_(std::move(commands)), frames_(std::move(frames)) {}
  Result<void> send(const aris::Command& command);
  void warn_of(const aris::DecodedFrame& frame);

  Socket commands_, frames_;
  std::uint32_t sonar_ip_ = 0;  // in network order
  aris::FrameAssembler assembler_;
  std::map<aris::SystemType, std::uint32_t> asked_;  // the cookie of the settings for each product; empty = none were sent
  bool warned_of_settings_ = false, warned_of_losses_ = false;
  Clock::time_point sent_at_{};
  std::size_t bytes_ = 0;  // received since the last whole frame
  std::vector<std::byte> chunk_ = std::vector<std::byte>(1 << 16);
};

}  // namespace sonar::clients
