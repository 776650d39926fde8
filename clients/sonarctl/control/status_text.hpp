// Converts status and events of a daemon to text. No I/O.
#pragma once

#include <string>

#include "core/base/geometry.hpp"

namespace sonar::v1 {  // from control.pb.h
class DaemonStatus;
class Event;
class ObjectStatus;
}  // namespace sonar::v1

namespace sonar::clients {

/// Returns several lines, each with its newline.
std::string text_from(const v1::DaemonStatus& status);
/// Returns one line without newline.
std::string text_from(const v1::ObjectStatus& object);
std::string text_from(const v1::Event& event);
/// Returns "-6.00 0.00 -3.00 m, heading 90, pitch -15, roll 0 deg": east, north, up; compass; bow up; starboard down.
std::string place_text(const Pose& body_in_world);

}  // namespace sonar::clients
