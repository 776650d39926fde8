// Makes the messages of a ping for viewers, each once for all viewers. Functions marked "Slow" run on a separate thread.
#pragma once

#include <memory>
#include <string>

#include "core/image/draw_picture.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/emulator/view/viewer.hpp"

namespace sonar {

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
