// The functions BVTHead_* of both interfaces, 3.x and 4.x (BVT_ABI). clients/bvtsdk/README.md describes their behaviour.
#include <cmath>

#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;

RetVal BVTHead_SetRange(BVTHead self, float start_m, float stop_m) {
  return on<Head>(self, [&](Head& o) { return o.set_range(start_m, stop_m); });
}
BVT_GETTER(float, Head, GetStartRange, Head, o.now.start_m)
BVT_GETTER(float, Head, GetStopRange, Head, o.now.stop_m)
BVT_GETTER(float, Head, GetMinimumRange, Head, o.now.min_range_m)
BVT_GETTER(float, Head, GetMaximumRange, Head, o.now.max_range_m)

RetVal BVTHead_SetSoundSpeed(BVTHead self, int metres_per_second) {
  return on<Head>(self, [&](Head& o) { return o.set(Key::sound_speed, metres_per_second, o.now.sound_speed_mps); });
}
BVT_GETTER(int, Head, GetSoundSpeed, Head, o.now.sound_speed_mps)
RetVal BVTHead_SetGainAdjustment(BVTHead self, float db) {
  return on<Head>(self, [&](Head& o) { return o.set(Key::gain, db, o.now.gain_db); });
}
BVT_GETTER(float, Head, GetGainAdjustment, Head, o.now.gain_db)
RetVal BVTHead_SetTVGSlope(BVTHead self, float db_per_m) {
  return on<Head>(self, [&](Head& o) { return o.set(Key::tvg, db_per_m, o.now.tvg_db_per_m); });
}
BVT_GETTER(float, Head, GetTVGSlope, Head, o.now.tvg_db_per_m)
RetVal BVTHead_SetFluidType(BVTHead self, int type) {
  return on<Head>(self,
                  [&](Head& o) -> int { return type < 0 || type > 2 ? bad_parameter : o.set(Key::fluid, type, o.now.fluid); });
}
BVT_GETTER(int, Head, GetFluidType, Head, o.now.fluid)
RetVal BVTHead_SetTxEnable(BVTHead self, int transmit) {
  return on<Head>(self, [&](Head& o) { return o.set(Key::transmit, transmit != 0, o.transmit); });
}
RetVal BVTHead_SetMountType(BVTHead self, int type) {
  return on<Head>(self, [&](Head& o) -> int {
    if (type < 0 || type > 5) return bad_parameter;
    o.mount = type;
    return success;
  });
}
BVT_GETTER(int, Head, GetMountType, Head, o.mount)

BVT_GETTER(int, Head, GetCenterFreq, Head, o.now.centre_hz)
BVT_GETTER(int, Head, GetPingCount, Head, o.ping_count())
BVT_GETTER(int, Head, GetImageProcessingMethod, Head, 1)
RetVal BVTHead_GetHeadName(BVTHead self, char* buffer, int size) {
  return get_text<Head>(self, buffer, size, [](Head& o) { return o.now.name; });
}

RetVal BVTHead_GetPing(BVTHead self, int number, BVTPing* out) {
  if (!out) return invalid_ptr;
  *out = nullptr;
  return on<Head>(self, [&](Head& o) -> int {
    std::shared_ptr<PingObject> ping;
    const int code = o.get_ping(number, ping);
    return code == success ? give(ping, out) : code;
  });
}
RetVal BVTHead_PutPing(BVTHead self, BVTPing ping) {
  return on<Head>(self, [&](Head& o) -> int { return on<PingObject>(ping, [&](PingObject& p) { return o.put_ping(p); }); });
}

// The next functions set how images of later pings are made; the settings are not sent to the sonar.
RetVal BVTHead_SetImageRes(BVTHead self, int resolution) {
  return on<Head>(self, [&](Head& o) -> int {
    if (resolution < 0 || resolution > 4) return invalid_resolution;
    o.imaging.image.resolution = static_cast<ImageRes>(resolution);
    return success;
  });
}
RetVal BVTHead_SetImageType(BVTHead self, int type) {
  return on<Head>(self, [&](Head& o) -> int {
    if (type != 0 && type != 1) return bad_image_type;
    o.imaging.type = static_cast<ImageType>(type);
    return success;
  });
}
RetVal BVTHead_SetImageReqSize(BVTHead self, int height, int width) {
  return on<Head>(self, [&](Head& o) -> int {
    if (height < 0 || width < 0) return invalid_image_size;
    o.imaging.image.requested_height = height;
    o.imaging.image.requested_width = width;
    return success;
  });
}
RetVal BVTHead_SetRangeResolution(BVTHead self, float metres) {
  return on<Head>(self, [&](Head& o) -> int {
    if (!std::isfinite(metres) || metres < 0) return invalid_resolution;
    o.imaging.image.range_resolution_m = metres;
    return success;
  });
}
RetVal BVTHead_SetImageFilterFlags(BVTHead self, int flags) {
  return on<Head>(self, [&](Head& o) -> int {
    o.imaging.image.filter_flags = flags;
    return success;
  });
}
BVT_GETTER(int, Head, GetImageFilterFlags, Head, o.imaging.image.filter_flags)

#if BVT_ABI == 3

RetVal BVTHead_SetRangeDataThreshold(BVTHead self, unsigned short threshold) {
  return on<Head>(self, [&](Head& o) -> int {
    o.imaging.ranges.threshold = threshold;
    return success;
  });
}

#else

void BVTHead_Destroy(BVTHead self) { destroy<Head>(self); }
RetVal BVTHead_SetStartRange(BVTHead self, float start_m) {
  return on<Head>(self, [&](Head& o) { return o.set_start(start_m); });
}
RetVal BVTHead_SetStopRange(BVTHead self, float stop_m) {
  return on<Head>(self, [&](Head& o) { return o.set_stop(stop_m); });
}
RetVal BVTHead_SetDynamicPowerManagement(BVTHead self, int on_or_off) {
  return on<Head>(self, [&](Head& o) { return o.set(Key::dynamic_power, on_or_off != 0, o.dynamic_power); });
}
BVT_GETTER(int, Head, GetDynamicPowerManagement, Head, o.dynamic_power)
RetVal BVTHead_SetPingInterval(BVTHead self, int milliseconds) {
  return on<Head>(self, [&](Head& o) -> int {
    return milliseconds < 0 ? bad_parameter : o.set(Key::ping_interval, milliseconds, o.ping_interval_ms);
  });
}
BVT_GETTER(int, Head, GetPingInterval, Head, o.ping_interval_ms)

#endif
