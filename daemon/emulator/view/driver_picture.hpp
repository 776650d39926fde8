// What a sonar's picture is to viewers: what its make's own host (protocol/host.hpp), which sonarctl runs too, shows a driver's
// user. Pure.
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
  /// Of pings in order; `state`: of the device that fired them. Quick, whatever the make: a picture of one ping is encoded and
  /// decoded by the drawing, which takes long to call; any thread may do that, also when this is gone. Null: there is nothing to
  /// see yet.
  Drawing after(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state);

 private:
  const protocol::Make& make_;
  std::unique_ptr<protocol::Host> host_;  // of a make whose picture adds up many pings
};

}  // namespace sonar
