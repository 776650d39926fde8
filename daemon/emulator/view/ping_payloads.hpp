// Makes the messages of a ping for viewers, each once for all viewers. Functions marked "Slow" run on a separate thread.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/image/draw_picture.hpp"
#include "core/image/sonar_picture.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/emulator/connections/pacer.hpp"
#include "daemon/emulator/sonar/sonar.hpp"
#include "daemon/emulator/view/viewer.hpp"
#include "protocol/host.hpp"

namespace sonar {

// Makes the picture of a sonar for viewers. The make's host (protocol/host.hpp), which sonarctl also uses, decodes the messages,
// so viewers get the picture that a driver would make.

class DriverPicture {
 public:
  using Drawing = std::function<SonarPicture()>;

  explicit DriverPicture(const protocol::Make& make);
  PictureKind kind() const { return make_.picture; }
  /// Returns a function that makes the picture after the next ping; null if there is nothing to show yet. Pings must be passed in
  /// order; `state` is that of the device that fired them. The returned function is slow, because it may encode and decode the
  /// ping; any thread may call it, even after the end of this object.
  Drawing after(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state);

 private:
  const protocol::Make& make_;
  std::unique_ptr<protocol::Host> host_;  // only for makes whose picture combines many pings
};

// Pings for viewers while no driver is connected: at most 5 per second, or 25 with one beam. They have their own numbers and
// noise, so that they do not affect a driver's pings. The caller computes the pings that are due, and calls why_over() regularly.

class Preview {
 public:
  static constexpr std::chrono::milliseconds shortest_period{200}, shortest_of_one_beam{40};
  static constexpr std::chrono::seconds longest{600};

  void begin(Time now) { until_ = now + longest; }
  void end();
  bool on() const { return until_.has_value(); }
  /// Returns the time between two previews of this sonar.
  static std::chrono::nanoseconds period(const Sonar& sonar);
  /// Returns the reason, for the log, why the preview must end now; empty if it may continue.
  std::string why_over(const Sonar& sonar, Time now) const;
  /// Returns the ping that is due. Call done() when the ping is computed; until then no other ping is due.
  std::optional<PingRequest> due(const Sonar& sonar, Time now);
  void done(bool made);
  /// Returns previews per second, which RecentRate measures; 0 = none.
  double hz(Time now) const { return made_.hz(now); }

 private:
  std::optional<Time> until_, fired_at_;
  std::uint32_t number_ = 0;
  bool busy_ = false;
  RecentRate made_;
};

/// Returns the picture of a ping. `shades`: shades of the make, for wide linear samples.
PolarImage polar_image_of(const Ping& ping, const Shades& shades = {});

using PingPointer = std::shared_ptr<const Ping>;
// The stamp of each message is the time at which the ping was fired; `sonar` is the name of its frame.
ViewPayloadPointer image_payload(const std::string& sonar, const PingPointer& ping);
ViewPayloadPointer geometry_payload(const Ping& ping);
/// Makes the ground truth of a ping, which must have it.
ViewPayloadPointer truth_payload(const Ping& ping);
/// Returns the edges of the volume that the beams cover, to the end of the range.
ViewPayloadPointer swath_payload(const std::string& sonar, const Ping& ping);
/// Returns the style of fan_payload(): gray, without rings.
FanStyle view_fan_style();
/// Returns the picture that `painter` draws in view_fan_style(), with 0 outside and 1 to 255 inside; null if it cannot be drawn.
/// Slow.
ViewPayloadPointer fan_payload(const std::string& sonar, Time at, const SonarPicture& picture, PicturePainter& painter);
/// Returns the axes of fan_payload(), as sonar.v1.Picture.
ViewPayloadPointer picture_payload(Time at, const SonarPicture& picture);
/// Returns the samples above the fraction `threshold` of full scale, at most the 20,000 brightest, as points in the plane of the
/// fan. Slow.
ViewPayloadPointer cloud_payload(const std::string& sonar, const Ping& ping, double threshold);

/// Makes a payload of one piece.
ViewPayloadPointer view_payload(Time at, wire::Bytes bytes);

}  // namespace sonar
