// The functions BVTMagImage_*, BVTColorImage_* and BVTColorMapper_*. clients/bvtsdk/README.md describes their behaviour.
#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;

#if BVT_ABI == 3
using Angle = double;
#else
using Angle = float;
#endif

namespace {

using MagPixel = unsigned short;
using ColourPixel = unsigned int;

/// Returns the first pixel of a row, or null.
template <class Image>
auto* row_of(Image& image, int row) {
  return inside(image, row, 0) ? image.pixels.data() + place(image, row, 0) : nullptr;
}

}  // namespace

// Functions that both kinds of image have.
#define BVT_IMAGE(Class, Kind, Pixel)                                                                                  \
  void BVT##Class##_Destroy(BVT##Class self) { destroy<Kind>(self); }                                                  \
  BVT_GETTER(int, Class, GetHeight, Kind, o.image.height)                                                              \
  BVT_GETTER(int, Class, GetWidth, Kind, o.image.width)                                                                \
  BVT_GETTER(Pixel*, Class, GetBits, Kind, o.image.pixels.data())                                                      \
  BVT_GETTER(double, Class, GetRangeResolution, Kind, o.image.range_resolution_m)                                      \
  BVT_GETTER(double, Class, GetBearingResolution, Kind, o.image.bearing_resolution_deg)                                \
  BVT_GETTER(int, Class, GetOriginRow, Kind, o.image.origin_row)                                                       \
  BVT_GETTER(int, Class, GetOriginCol, Kind, o.image.origin_col)                                                       \
  BVT_GETTER(Angle, Class, GetFOVMinAngle, Kind, o.image.fov_min_deg)                                                  \
  BVT_GETTER(Angle, Class, GetFOVMaxAngle, Kind, o.image.fov_max_deg)                                                  \
  BVT_GETTER_AT(double, Class, GetPixelRange, Kind, (int row, int col), o.image.pixel_range_m(row, col))               \
  BVT_GETTER_AT(double, Class, GetPixelRelativeBearing, Kind, (int row, int col), o.image.pixel_bearing_deg(row, col)) \
  RetVal BVT##Class##_CopyBits(BVT##Class self, Pixel* buffer, unsigned int pixels) {                                  \
    return on<Kind>(self, [&](Kind& o) { return copy_values(o.image.pixels, buffer, pixels); });                       \
  }

BVT_IMAGE(MagImage, MagImageObject, MagPixel)
BVT_IMAGE(ColorImage, ColourImageObject, ColourPixel)

// The next functions give null or 0 for a row or pixel outside the image; in 4.x they return the code index_out_of_bounds.
#if BVT_ABI == 3
#define BVT_PIXELS(Class, Kind, Pixel)                                                                                           \
  Pixel* BVT##Class##_GetRow(BVT##Class self, int row) {                                                                         \
    return value<Kind>(self, static_cast<Pixel*>(nullptr), [&](Kind& o) { return row_of(o.image, row); });                       \
  }                                                                                                                              \
  Pixel BVT##Class##_GetPixel(BVT##Class self, int row, int col) {                                                               \
    return value<Kind>(self, Pixel{},                                                                                            \
                       [&](Kind& o) { return inside(o.image, row, col) ? o.image.pixels[place(o.image, row, col)] : Pixel{}; }); \
  }
#else
#define BVT_PIXELS(Class, Kind, Pixel)                                          \
  RetVal BVT##Class##_GetRow(BVT##Class self, int row, Pixel** out) {           \
    return try_get<Kind>(self, out, [&](Kind& o, Pixel*& first) -> int {        \
      first = row_of(o.image, row);                                             \
      return first ? success : index_out_of_bounds;                             \
    });                                                                         \
  }                                                                             \
  RetVal BVT##Class##_GetPixel(BVT##Class self, int row, int col, Pixel* out) { \
    return try_get<Kind>(self, out, [&](Kind& o, Pixel& pixel) -> int {         \
      if (!inside(o.image, row, col)) return index_out_of_bounds;               \
      pixel = o.image.pixels[place(o.image, row, col)];                         \
      return success;                                                           \
    });                                                                         \
  }
#endif

BVT_PIXELS(MagImage, MagImageObject, MagPixel)
BVT_PIXELS(ColorImage, ColourImageObject, ColourPixel)

RetVal BVTMagImage_SavePGM(BVTMagImage self, const char* file_name) {
  return on<MagImageObject>(self,
                            [&](MagImageObject& o) -> int { return file_name ? save_pgm(file_name, o.image) : bad_parameter; });
}
RetVal BVTColorImage_SavePPM(BVTColorImage self, const char* file_name) {
  return on<ColourImageObject>(
      self, [&](ColourImageObject& o) -> int { return file_name ? save_ppm(file_name, o.image) : bad_parameter; });
}

BVTColorMapper BVTColorMapper_Create() { return create<ColourMapperObject, BVTColorMapper>(); }
void BVTColorMapper_Destroy(BVTColorMapper self) { destroy<ColourMapperObject>(self); }
RetVal BVTColorMapper_Load(BVTColorMapper self, const char* file_name) {
  return on<ColourMapperObject>(
      self, [&](ColourMapperObject& o) -> int { return file_name ? o.mapper.load(file_name) : bad_parameter; });
}
RetVal BVTColorMapper_MapImage(BVTColorMapper self, BVTMagImage image, BVTColorImage* out) {
  return make<ColourMapperObject, ColourImageObject>(self, out, [&](ColourMapperObject& o, ColourImageObject& colours) -> int {
    return on<MagImageObject>(image, [&](MagImageObject& m) { return o.mapper.map(m.image, colours.image); });
  });
}
RetVal BVTColorMapper_SetThresholds(BVTColorMapper self, int top, int bottom) {
  return on<ColourMapperObject>(self, [&](ColourMapperObject& o) { return o.mapper.set_thresholds(top, bottom); });
}
RetVal BVTColorMapper_SetGamma(BVTColorMapper self, float gamma) {
  return on<ColourMapperObject>(self, [&](ColourMapperObject& o) { return o.mapper.set_gamma(gamma); });
}
RetVal BVTColorMapper_SetAutoMode(BVTColorMapper self, int on_or_off) {
  return on<ColourMapperObject>(self, [&](ColourMapperObject& o) -> int {
    o.mapper.set_auto_mode(on_or_off != 0);
    return success;
  });
}
BVT_GETTER(int, ColorMapper, GetTopThreshold, ColourMapperObject, o.mapper.top())
BVT_GETTER(int, ColorMapper, GetBottomThreshold, ColourMapperObject, o.mapper.bottom())
BVT_GETTER(float, ColorMapper, GetGamma, ColourMapperObject, o.mapper.gamma())
BVT_GETTER(int, ColorMapper, GetAutoMode, ColourMapperObject, o.mapper.auto_mode())
