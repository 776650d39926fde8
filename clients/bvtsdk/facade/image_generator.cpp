// The functions BVTImageGenerator_* of 4.x, which make images and range profiles. clients/bvtsdk/README.md describes their
// behaviour.
#include <cmath>

#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;
using Generator = sonar::bvt::ImageGeneratorObject;

namespace {

/// Creates an N and fills it with work(generator, ping, N). Returns bad_head if SetHead was not called.
template <class N, class H, class F>
RetVal from_ping(BVTImageGenerator self, BVTPing ping, H* out, F work) {
  return make<Generator, N>(self, out, [&](Generator& o, N& fresh) -> int {
    if (!o.has_head) return bad_head;
    return on<PingObject>(ping, [&](PingObject& p) { return work(o, p.polar, fresh); });
  });
}

RetVal image_of(BVTImageGenerator self, BVTPing ping, BVTMagImage* out, ImageType type) {
  return from_ping<MagImageObject>(self, ping, out, [&](Generator& o, const PolarPing& p, MagImageObject& image) {
    return o.imager.make(p, type, o.image, image.image);
  });
}

template <class V>
RetVal keep(BVTImageGenerator self, V& (*where)(Generator&), V value, bool valid, int refusal = bad_parameter) {
  return on<Generator>(self, [&](Generator& o) -> int {
    if (!valid) return refusal;
    where(o) = value;
    return success;
  });
}

bool is_fraction(float value) { return value >= 0 && value <= 1; }

}  // namespace

BVTImageGenerator BVTImageGenerator_Create() { return create<Generator, BVTImageGenerator>(); }
void BVTImageGenerator_Destroy(BVTImageGenerator self) { destroy<Generator>(self); }

RetVal BVTImageGenerator_SetHead(BVTImageGenerator self, BVTHead head) {
  return on<Generator>(self, [&](Generator& o) -> int {
    o.has_head = handles().find<Head>(head) != nullptr;
    return o.has_head ? success : invalid_ptr;
  });
}
RetVal BVTImageGenerator_GetImageXY(BVTImageGenerator self, BVTPing ping, BVTMagImage* out) {
  return image_of(self, ping, out, ImageType::xy);
}
RetVal BVTImageGenerator_GetImageRTheta(BVTImageGenerator self, BVTPing ping, BVTMagImage* out) {
  return image_of(self, ping, out, ImageType::r_theta);
}
RetVal BVTImageGenerator_GetRangeProfile(BVTImageGenerator self, BVTPing ping, BVTRangeProfile* out) {
  return from_ping<RangeListObject>(self, ping, out, [](Generator& o, const PolarPing& p, RangeListObject& profile) {
    o.ranges.noise_threshold = o.image.noise_threshold;
    o.ranges.sound_speed_override_mps = o.image.sound_speed_override_mps;
    return make_range_list(p, o.ranges, profile.list);
  });
}

RetVal BVTImageGenerator_SetImageResolutionPolicy(BVTImageGenerator self, int resolution) {
  return keep<ImageRes>(
      self, [](Generator & o) -> auto& { return o.image.resolution; }, static_cast<ImageRes>(resolution),
      resolution >= 0 && resolution <= 4, invalid_resolution);
}
RetVal BVTImageGenerator_SetRangeResolution(BVTImageGenerator self, float metres) {
  return keep<float>(
      self, [](Generator & o) -> auto& { return o.image.range_resolution_m; }, metres, std::isfinite(metres) && metres >= 0,
      invalid_resolution);
}
RetVal BVTImageGenerator_SetRThetaImageWidth(BVTImageGenerator self, int columns) {
  return keep<int>(
      self, [](Generator & o) -> auto& { return o.image.r_theta_width; }, columns, columns >= 0, invalid_image_size);
}
RetVal BVTImageGenerator_SetImageFilterFlags(BVTImageGenerator self, int flags) {
  return keep<int>(
      self, [](Generator & o) -> auto& { return o.image.filter_flags; }, flags, true);
}
RetVal BVTImageGenerator_SetNoiseThreshold(BVTImageGenerator self, float fraction) {
  return keep<float>(
      self, [](Generator & o) -> auto& { return o.image.noise_threshold; }, fraction, is_fraction(fraction));
}
RetVal BVTImageGenerator_SetClippingThreshold(BVTImageGenerator self, float fraction) {
  return keep<float>(
      self, [](Generator & o) -> auto& { return o.image.clipping_threshold; }, fraction, is_fraction(fraction));
}
RetVal BVTImageGenerator_SetSoundSpeedOverride(BVTImageGenerator self, int metres_per_second) {
  return keep<int>(
      self, [](Generator & o) -> auto& { return o.image.sound_speed_override_mps; }, metres_per_second, metres_per_second >= 0);
}
RetVal BVTImageGenerator_SetRangeProfileIntensityThreshold(BVTImageGenerator self, unsigned short threshold) {
  return keep<std::uint16_t>(
      self, [](Generator & o) -> auto& { return o.ranges.threshold; }, threshold, true);
}
RetVal BVTImageGenerator_SetRangeProfileStartRange(BVTImageGenerator self, float metres) {
  return keep<float>(
      self, [](Generator & o) -> auto& { return o.ranges.start_range_m; }, metres, std::isfinite(metres) && metres >= 0);
}
BVT_GETTER(int, ImageGenerator, GetImageResolutionPolicy, Generator, o.image.resolution)
BVT_GETTER(float, ImageGenerator, GetRangeResolution, Generator, o.image.range_resolution_m)
BVT_GETTER(int, ImageGenerator, GetRThetaImageWidth, Generator, o.image.r_theta_width)
BVT_GETTER(int, ImageGenerator, GetImageFilterFlags, Generator, o.image.filter_flags)
BVT_GETTER(float, ImageGenerator, GetNoiseThreshold, Generator, o.image.noise_threshold)
BVT_GETTER(float, ImageGenerator, GetClippingThreshold, Generator, o.image.clipping_threshold)
BVT_GETTER(int, ImageGenerator, GetSoundSpeedOverride, Generator, o.image.sound_speed_override_mps)
BVT_GETTER(unsigned short, ImageGenerator, GetRangeProfileIntensityThreshold, Generator, o.ranges.threshold)
BVT_GETTER(float, ImageGenerator, GetRangeProfileStartRange, Generator, o.ranges.start_range_m)

RetVal BVTImageGenerator_SetXYImageSize(BVTImageGenerator self, int width, int height) {
  return on<Generator>(self, [&](Generator& o) -> int {
    if (width < 0 || height < 0) return invalid_image_size;
    o.image.requested_width = width;
    o.image.requested_height = height;
    return success;
  });
}
RetVal BVTImageGenerator_GetXYImageSize(BVTImageGenerator self, int* width, int* height) {
  if (width) *width = 0;
  if (height) *height = 0;
  if (!width || !height) return invalid_ptr;
  return on<Generator>(self, [&](Generator& o) -> int {
    *width = o.image.requested_width;
    *height = o.image.requested_height;
    return success;
  });
}
