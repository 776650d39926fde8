// Makes the picture of a sonar for viewers. The make's host (protocol/host.hpp), which sonarctl also uses, decodes the
// messages, so viewers see what a driver sees. Pure.
#pragma once

#include <functional>
#include <memory>

#include "core/image/sonar_picture.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/host.hpp"

namespace sonar {

class DriverPicture {
 public:
  using Drawing = std::function<SonarPicture()>;

  explicit DriverPicture(const protocol::Make& make);
  PictureKind kind() const { return make_.picture; }
  /// The drawing after the next ping. Pings must be passed in order; `state` is that of the device that fired them. This call
  /// is fast. Calling the returned function is slow, because it may encode and decode the ping; any thread may do so, even
  /// after the end of this object. Null: nothing to show yet.
  Drawing after(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state);

 private:
  const protocol::Make& make_;
  std::unique_ptr<protocol::Host> host_;  // only for makes whose picture combines many pings
};

}  // namespace sonar
