// The functions BVTNavData_* (navigation data) of the interfaces 3.x and 4.x; 3.x has no NavTime. A value that was not set
// returns nav_no_data; infinite and NaN values are refused.
#include <cmath>

#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;

namespace {
constexpr std::size_t longest_text = 80;
}

#define BVT_NAV_FIELD(Type, Name, bit, member)                              \
  RetVal BVTNavData_Set##Name(BVTNavData self, Type value) {                \
    return on<NavObject>(self, [&](NavObject& o) -> int {                   \
      if (!std::isfinite(value)) return bad_parameter;                      \
      o.nav.member = value;                                                 \
      o.nav.present = static_cast<std::uint16_t>(o.nav.present | bit);      \
      return success;                                                       \
    });                                                                     \
  }                                                                         \
  RetVal BVTNavData_Get##Name(BVTNavData self, Type* out) {                 \
    return try_get<NavObject>(self, out, [](NavObject& o, Type& v) -> int { \
      if (!o.nav.has(bit)) return nav_no_data;                              \
      v = o.nav.member;                                                     \
      return success;                                                       \
    });                                                                     \
  }

BVTNavData BVTNavData_Create() { return create<NavObject, BVTNavData>(); }
void BVTNavData_Destroy(BVTNavData self) { destroy<NavObject>(self); }

#if BVT_ABI == 4
BVT_NAV_FIELD(double, NavTime, nav_time, time_s)
#endif
BVT_NAV_FIELD(double, Latitude, nav_latitude, latitude_deg)
BVT_NAV_FIELD(double, Longitude, nav_longitude, longitude_deg)
BVT_NAV_FIELD(float, Depth, nav_depth, depth_m)
BVT_NAV_FIELD(float, Altitude, nav_altitude, altitude_m)
BVT_NAV_FIELD(float, PitchAngle, nav_pitch, pitch_deg)
BVT_NAV_FIELD(float, RollAngle, nav_roll, roll_deg)
BVT_NAV_FIELD(float, Heading, nav_heading, heading_deg)
BVT_NAV_FIELD(float, HeadingVelocity, nav_heading_velocity, heading_velocity_mps)
BVT_NAV_FIELD(float, CourseOverGround, nav_course, course_deg)

RetVal BVTNavData_SetUserNavString(BVTNavData self, const char* text) {
  return on<NavObject>(self, [&](NavObject& o) -> int {
    if (!text || std::strlen(text) > longest_text) return bad_parameter;
    o.nav.text = text;
    o.nav.present = static_cast<std::uint16_t>(o.nav.present | nav_text);
    return success;
  });
}
RetVal BVTNavData_GetUserNavString(BVTNavData self, char* buffer, int size) {
  if (buffer && size > 0) buffer[0] = '\0';
  return on<NavObject>(
      self, [&](NavObject& o) -> int { return o.nav.has(nav_text) ? copy_text(o.nav.text, buffer, size) : nav_no_data; });
}
