// Where decoded pings come from: a device's TCP stream with our settings sent to it, a recording of one, and the status
// datagrams that lead to a device. Both kinds of sonars. Shared by listen, view, stats and doctor.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/any_ping.hpp"
#include "clients/sonarctl/blueview_stream.hpp"
#include "clients/sonarctl/net.hpp"
#include "core/base/result.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::clients {

/// What speaks at an address; either: an Oculus there, or a BlueView head at its own port, whichever answers.
enum class SonarKind { oculus, blueview, either };

/// Settings to send, by what is met.
struct Settings {
  std::optional<oculus::FireRequest> oculus;
  HeadWish head;
};

class PingStream {
 public:
  /// Connects, greets a head, and sends the settings. `patience`: for the connection, and for a head's answers.
  static Result<PingStream> open(const Endpoint& device, SonarKind kind, Settings settings, std::chrono::milliseconds patience);

  struct Item {
    Wait what = Wait::timed_out;
    std::optional<AnyPing> ping;            // with Wait::data this,
    std::optional<oculus::Received> other;  // or this
    std::string error;
  };
  /// The next message, or what happened instead within `patience`.
  Item next(std::chrono::milliseconds patience);
  /// Sends the settings once more. Nothing to do for heads: they answered.
  Result<void> ask_again();
  /// The connection is ended before the first byte; known when that byte comes, and no later than `patience`. Never that of a
  /// head, which has greeted.
  bool is_turned_away(std::chrono::milliseconds patience) const;
  /// Also writes every received byte to this file. usage: of a BlueView head.
  Result<void> record_to(const std::filesystem::path& file);
  std::uint64_t junk_bytes() const { return decoder_.skipped_bytes(); }
  const Endpoint& device() const { return device_; }
  bool is_blueview() const { return blueview_.has_value(); }
  /// "127.0.0.2:14750, BlueView P900-90, serial 7001"
  std::string about() const { return text_from(device_) + (blueview_ ? ", " + blueview_->about() : ""); }

 private:
  PingStream(Endpoint device, Socket socket, std::optional<oculus::FireRequest> asked)
      : device_(std::move(device)), socket_(std::move(socket)), asked_(std::move(asked)) {}
  PingStream(Endpoint device, BlueViewStream blueview)
      : device_(std::move(device)), socket_(-1), blueview_(std::move(blueview)) {}

  Endpoint device_;
  Socket socket_;  // of an Oculus
  std::optional<BlueViewStream> blueview_;
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
