// A program that uses a Sonar 3D-15 (docs/protocols/waterlinked.md): settings over HTTP, images by multicast. Used by
// ping_stream.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "clients/sonarctl/any_ping.hpp"
#include "clients/sonarctl/blueview_stream.hpp"
#include "clients/sonarctl/net.hpp"
#include "core/base/result.hpp"
#include "protocol/waterlinked/messages.hpp"

namespace sonar::clients {

inline constexpr std::uint16_t waterlinked_port = 80;

/// As seen from above: of every column of pixels the strengths at their horizontal ranges. Without strengths: all the same.
/// Nothing: the messages are not of one image.
std::optional<PicturePing> ping_from(const waterlinked::RangeMessage& ranges, const waterlinked::StrengthMessage* strengths);

class WaterlinkedStream {
 public:
  /// Switches acoustics and multicast on and applies the settings, range and mode; nothing: uses the sonar as it is.
  /// usage: a setting that no Sonar 3D-15 has, images that go elsewhere.
  static Result<WaterlinkedStream> open(const Endpoint& device, const std::optional<HeadRequest>& request,
                                        std::chrono::milliseconds patience);

  struct Item {
    Wait what = Wait::timed_out;
    std::optional<PicturePing> ping;  // with Wait::data
    std::string error;
  };
  Item next(std::chrono::milliseconds patience);

 private:
  WaterlinkedStream(Socket images, std::uint32_t sonar_ip) : images_(std::move(images)), sonar_ip_(sonar_ip) {}
  std::optional<PicturePing> take(wire::BytesView datagram);

  Socket images_;
  std::uint32_t sonar_ip_;                         // in network order
  std::optional<waterlinked::RangeMessage> half_;  // its strengths have not arrived yet
  std::size_t bytes_ = 0;                          // received since the last ping
  std::vector<std::byte> chunk_ = std::vector<std::byte>(1 << 16);
};

}  // namespace sonar::clients
