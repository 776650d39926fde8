// Sources of decoded pings: the TCP stream of a device (after sending settings), a recording of one, and the status datagrams
// that announce a device. All kinds of sonars. Shared by listen, view, stats and doctor.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "clients/sonarctl/any_ping.hpp"
#include "clients/sonarctl/aris_stream.hpp"
#include "clients/sonarctl/blueview_stream.hpp"
#include "clients/sonarctl/brping_stream.hpp"
#include "clients/sonarctl/net.hpp"
#include "clients/sonarctl/waterlinked_stream.hpp"
#include "core/base/result.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::clients {

/// Kind of sonar at an address; either: an Oculus there, or another at its own port, the first that answers. brping: that of the
/// ping protocol which is usual at that port. waterlinked: a Sonar 3D-15.
enum class SonarKind { oculus, blueview, either, aris, brping, waterlinked };

/// Settings to send, by kind of sonar. Without `oculus` none: an ARIS is not sent `head` either.
struct Settings {
  std::optional<oculus::FireRequest> oculus;
  HeadRequest head;
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
  /// The next message, or the event that replaced it within `patience`.
  Item next(std::chrono::milliseconds patience);
  /// Sends the settings once more. No effect on heads, which have confirmed them.
  Result<void> ask_again();
  /// True when the sonar closes the connection before the first byte; waits for that byte, at most `patience`. Never true of a
  /// head, which has greeted.
  bool is_rejected(std::chrono::milliseconds patience) const;
  /// Also writes every received byte to this file. usage: of another sonar than an Oculus.
  Result<void> record_to(const std::filesystem::path& file);
  std::uint64_t junk_bytes() const { return decoder_.skipped_bytes(); }
  const Endpoint& device() const { return device_; }
  bool is_blueview() const { return std::holds_alternative<BlueViewStream>(other_); }
  bool is_oculus() const { return std::holds_alternative<std::monostate>(other_); }
  /// "127.0.0.2:14750, BlueView P900-90, serial 7001"
  std::string about() const;

 private:
  PingStream(Endpoint device, Socket socket, std::optional<oculus::FireRequest> asked)
      : device_(std::move(device)), socket_(std::move(socket)), asked_(std::move(asked)) {}
  using Other = std::variant<std::monostate, BlueViewStream, ArisStream, BrpingStream, WaterlinkedStream>;
  PingStream(Endpoint device, Other other) : device_(std::move(device)), socket_(-1), other_(std::move(other)) {}

  Endpoint device_;
  Socket socket_;  // of an Oculus
  Other other_;    // another sonar's
  std::optional<oculus::FireRequest> asked_;
  oculus::Decoder decoder_;
  std::ofstream record_;
};

/// Every ping of a raw dump: messages back to back, exactly the bytes of the TCP stream.
Result<std::vector<oculus::DecodedPing>> read_recording(const std::filesystem::path& file);

/// Waits for the status broadcast of a device on UDP 52102; reports deviations that real drivers reject in `complaints`.
struct Discovered {
  oculus::StatusMessage status;
  Endpoint device;
  std::vector<std::string> complaints;
};
Result<Discovered> discover(std::chrono::milliseconds patience);

}  // namespace sonar::clients
