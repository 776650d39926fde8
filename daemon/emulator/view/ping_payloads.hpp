// Makes the messages of a ping for viewers, each once for all viewers. Functions marked "Slow" run on a separate thread. Pure.
#pragma once

#include <memory>
#include <string>

#include "core/image/draw_picture.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/emulator/view/viewer.hpp"

namespace sonar {

/// The picture of a ping. `shades`: those of its make, for wide linear samples.
PolarImage polar_image_of(const Ping& ping, const Shades& shades = {});

using PingPointer = std::shared_ptr<const Ping>;
// The stamp is the time at which the ping was fired; `sonar` is the frame.
ViewPayloadPointer image_payload(const std::string& sonar, const PingPointer& ping);
ViewPayloadPointer geometry_payload(const Ping& ping);
/// Requires a ping with ground truth.
ViewPayloadPointer truth_payload(const Ping& ping);
/// The edges of the volume that the beams cover, to the end of the range.
ViewPayloadPointer swath_payload(const std::string& sonar, const Ping& ping);
/// The style of fan_payload(): gray, without rings.
FanStyle view_fan_style();
/// The picture that `painter` draws in view_fan_style(): 0 outside, 1 to 255 inside. Slow. Null: it cannot be drawn.
ViewPayloadPointer fan_payload(const std::string& sonar, Time at, const SonarPicture& picture, PicturePainter& painter);
/// The axes of fan_payload(), as sonar.v1.Picture.
ViewPayloadPointer picture_payload(Time at, const SonarPicture& picture);
/// The samples above the fraction `threshold` of full scale, in the plane of the fan, at most the 20,000 brightest. Slow.
ViewPayloadPointer cloud_payload(const std::string& sonar, const Ping& ping, double threshold);

/// A payload of one piece.
ViewPayloadPointer view_payload(Time at, wire::Bytes bytes);

}  // namespace sonar
