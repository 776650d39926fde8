// A host on the BlueView link (docs/protocols/blueview-link.md) over one blocking socket: greeting, settings, and pings requested
// one by one, as drivers do. Used by ping_stream.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "clients/bvtsdk/core/description.hpp"
#include "clients/sonarctl/any_ping.hpp"
#include "clients/sonarctl/net.hpp"
#include "core/base/result.hpp"
#include "protocol/blueview/frames.hpp"

namespace sonar::clients {

/// Settings that the user typed; unset fields keep the value that the sonar has.
struct HeadRequest {
  std::optional<std::size_t> head;  // from 0, in the order of the greeting; of a Sonar 3D-15: its mode
  std::optional<double> range_m, rate_hz, gain_percent;
  std::vector<std::string> oculus_only;  // options typed that only an Oculus has
};

class BlueViewStream {
 public:
  /// Greets and applies the settings. `patience`: for every answer. io: closed without an answer; bad_data: another service;
  /// unavailable: no answer; usage: a request that no head supports.
  static Result<BlueViewStream> open(Socket socket, const HeadRequest& request, std::chrono::milliseconds patience);

  struct Item {
    Wait what = Wait::timed_out;
    std::optional<BlueViewPing> ping;  // with Wait::data
    std::string error;
  };
  /// Requests a ping, unless one is pending, and waits for it.
  Item next(std::chrono::milliseconds patience);
  /// "BlueView P900-90, serial 7001"
  std::string about() const { return sonar_.model + ", serial " + sonar_.serial; }

 private:
  using Clock = std::chrono::steady_clock;

  explicit BlueViewStream(Socket socket) : socket_(std::move(socket)) {}
  Result<wire::Bytes> ask(blueview::FrameType type, wire::BytesView payload, std::chrono::milliseconds patience);
  Result<void> greet(std::chrono::milliseconds patience);
  Result<void> apply(const HeadRequest& request, std::chrono::milliseconds patience);
  Result<void> set(blueview::Key key, const blueview::Value& value, std::chrono::milliseconds patience);
  Result<void> send(blueview::FrameType type, std::uint32_t id, wire::BytesView payload);
  /// Reads more bytes into the framer; sends keep-alives.
  Read receive(Clock::time_point deadline);
  Item handle(const blueview::Frame& frame);

  Socket socket_;
  blueview::Framer framer_{blueview::longest_payload};
  bvt::SonarDescription sonar_;
  std::size_t head_ = 0;  // index into sonar_.heads
  std::uint32_t last_id_ = 0;
  bool asked_ = false;  // a requested ping has not arrived yet
  Clock::time_point sent_at_{};
  std::vector<std::byte> chunk_ = std::vector<std::byte>(1 << 16);
};

}  // namespace sonar::clients
