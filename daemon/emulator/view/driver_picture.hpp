// Makes the picture of a sonar for viewers. The host of the make (protocol/host.hpp), which sonarctl uses too, decodes the
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
  /// The drawing after the next ping; pings come in order, `state` is that of the device that fired them. The call is quick for
  /// every make. Calling the drawing takes long, because it may encode and decode the ping; any thread may do that, also when
  /// this object is gone. Null: there is nothing to see yet.
  Drawing after(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state);

 private:
  const protocol::Make& make_;
  std::unique_ptr<protocol::Host> host_;  // for a make whose picture adds up many pings
};

}  // namespace sonar
