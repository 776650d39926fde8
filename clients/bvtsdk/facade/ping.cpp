// The functions BVTPing_*: images, navigation data and, in 3.x, range data of a ping. See clients/bvtsdk/README.md.

#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;

namespace {

RetVal image_of(BVTPing self, BVTMagImage* out, const ImageType* type) {
  return make<PingObject, MagImageObject>(self, out, [&](PingObject& o, MagImageObject& image) {
    return o.imager->make(o.polar, type ? *type : o.imaging.type, o.imaging.image, image.image);
  });
}

}  // namespace

void BVTPing_Destroy(BVTPing self) { destroy<PingObject>(self); }

RetVal BVTPing_GetImage(BVTPing self, BVTMagImage* out) { return image_of(self, out, nullptr); }
RetVal BVTPing_GetImageXY(BVTPing self, BVTMagImage* out) {
  const ImageType type = ImageType::xy;
  return image_of(self, out, &type);
}
RetVal BVTPing_GetImageRTheta(BVTPing self, BVTMagImage* out) {
  const ImageType type = ImageType::r_theta;
  return image_of(self, out, &type);
}

BVT_GETTER(double, Ping, GetTimestamp, PingObject, o.polar.time_s)
BVT_GETTER(int, Ping, GetTimeZoneOffset, PingObject, o.polar.time_zone_s)
BVT_GETTER(int, Ping, GetPingNumber, PingObject, o.polar.number)

RetVal BVTPing_GetNavDataCopy(BVTPing self, BVTNavData* out) {
  return make<PingObject, NavObject>(self, out, [&](PingObject& o, NavObject& copy) -> int {
    copy.nav = o.polar.nav;
    return o.polar.nav.present ? success : nav_no_data;
  });
}

namespace {
RetVal put_nav(BVTPing self, BVTNavData nav) {
  return on<PingObject>(self, [&](PingObject& o) -> int {
    return on<NavObject>(nav, [&](NavObject& n) -> int {
      o.polar.nav = n.nav;
      return success;
    });
  });
}
}  // namespace

#if BVT_ABI == 3

RetVal BVTPing_PutNavData(BVTPing self, BVTNavData nav) { return put_nav(self, nav); }

RetVal BVTPing_GetRangeData(BVTPing self, BVTRangeData* out) {
  if (!out) return invalid_ptr;
  *out = nullptr;
  return on<PingObject>(self, [&](PingObject& o) -> int {
    if (!o.range_data) {
      const auto fresh = std::make_shared<RangeListObject>();
      const int code = make_range_list(o.polar, o.imaging.ranges, fresh->list);
      if (code != success) return code;
      // Programs divide ranges by range_resolution_m to get rows of the ping's image (verified), so the value must be that of
      // the image.
      ImageGeometry image;
      if (plan_image(o.polar, o.imaging.type, o.imaging.image, image) == success)
        fresh->list.range_resolution_m = image.range_resolution_m;
      o.range_data = handles().add(fresh);
    }
    *out = static_cast<BVTRangeData>(o.range_data);
    return *out ? success : memory_alloc;
  });
}

#else

RetVal BVTPing_SetNavData(BVTPing self, BVTNavData nav) { return put_nav(self, nav); }
BVT_GETTER(float, Ping, GetStartRange, PingObject, o.polar.start_m)
BVT_GETTER(float, Ping, GetStopRange, PingObject, o.polar.stop_m)
BVT_GETTER(int, Ping, GetSoundSpeed, PingObject, o.polar.sound_speed_mps)
BVT_GETTER(int, Ping, HasNavData, PingObject, o.polar.nav.present != 0)
RetVal BVTPing_GetFOV(BVTPing self, float* min_deg, float* max_deg) {
  if (min_deg) *min_deg = 0;
  if (max_deg) *max_deg = 0;
  if (!min_deg || !max_deg) return invalid_ptr;
  return on<PingObject>(self, [&](PingObject& o) -> int {
    *min_deg = o.polar.fov_min_deg;
    *max_deg = o.polar.fov_max_deg;
    return success;
  });
}

#endif
