// The functions BVTRangeData_* (3.x) and BVTRangeProfile_* (4.x). clients/bvtsdk/README.md describes their behaviour.
#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;

namespace {

bool has(const RangeList& list, int i) { return i >= 0 && i < list.count(); }
std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

#if BVT_ABI == 3

BVT_GETTER(int, RangeData, GetCount, RangeListObject, o.list.count())
float BVTRangeData_GetRangeValue(BVTRangeData self, int i) {
  return value<RangeListObject>(self, no_range_m,
                                [&](RangeListObject& o) { return has(o.list, i) ? o.list.range_m[at(i)] : no_range_m; });
}
BVT_GETTER_AT(float, RangeData, GetBearingValue, RangeListObject, (int i), has(o.list, i) ? o.list.bearing_deg[at(i)] : 0.0f)
BVT_GETTER_AT(unsigned short, RangeData, GetIntensityValue, RangeListObject, (int i),
              has(o.list, i) ? o.list.intensity[at(i)] : 0)
BVT_GETTER(float, RangeData, GetFOVMinAngle, RangeListObject, o.list.fov_min_deg)
BVT_GETTER(float, RangeData, GetFOVMaxAngle, RangeListObject, o.list.fov_max_deg)
BVT_GETTER(double, RangeData, GetRangeResolution, RangeListObject, o.list.range_resolution_m)
BVT_GETTER(double, RangeData, GetBearingResolution, RangeListObject, o.list.bearing_resolution_deg)
RetVal BVTRangeData_CopyRangeValues(BVTRangeData self, float* buffer, int count) {
  return on<RangeListObject>(self, [&](RangeListObject& o) { return copy_values(o.list.range_m, buffer, count); });
}

#else

namespace {
/// Sets *out to the value that work(list) returns; index_out_of_bounds if the list has no entry i.
template <class V, class F>
RetVal entry(BVTRangeProfile self, int i, V* out, F work) {
  return try_get<RangeListObject>(self, out, [&](RangeListObject& o, V& v) -> int {
    if (!has(o.list, i)) return index_out_of_bounds;
    v = static_cast<V>(work(o.list));
    return success;
  });
}
}  // namespace

void BVTRangeProfile_Destroy(BVTRangeProfile self) { destroy<RangeListObject>(self); }
BVT_GETTER(int, RangeProfile, GetCount, RangeListObject, o.list.count())
BVT_GETTER(int, RangeProfile, GetValidCount, RangeListObject, o.list.valid_count())
RetVal BVTRangeProfile_CopyRangeValues(BVTRangeProfile self, float* buffer, int count) {
  return on<RangeListObject>(self, [&](RangeListObject& o) { return copy_values(o.list.range_m, buffer, count); });
}
RetVal BVTRangeProfile_CopyBearingValues(BVTRangeProfile self, float* buffer, int count) {
  return on<RangeListObject>(self, [&](RangeListObject& o) { return copy_values(o.list.bearing_deg, buffer, count); });
}
RetVal BVTRangeProfile_CopyIntensityValues(BVTRangeProfile self, unsigned short* buffer, int count) {
  return on<RangeListObject>(self, [&](RangeListObject& o) { return copy_values(o.list.intensity, buffer, count); });
}
RetVal BVTRangeProfile_GetRangeValue(BVTRangeProfile self, int i, float* out) {
  return entry(self, i, out, [i](const RangeList& list) { return list.range_m[at(i)]; });
}
RetVal BVTRangeProfile_GetBearingValue(BVTRangeProfile self, int i, float* out) {
  return entry(self, i, out, [i](const RangeList& list) { return list.bearing_deg[at(i)]; });
}
RetVal BVTRangeProfile_GetIntensityValue(BVTRangeProfile self, int i, unsigned short* out) {
  return entry(self, i, out, [i](const RangeList& list) { return list.intensity[at(i)]; });
}
RetVal BVTRangeProfile_GetValidValue(BVTRangeProfile self, int i, int* out) {
  return entry(self, i, out, [i](const RangeList& list) { return list.valid(i); });
}
RetVal BVTRangeProfile_Get_X_Value(BVTRangeProfile self, int i, float* out) {
  return entry(self, i, out, [i](const RangeList& list) { return list.x_m(i); });
}
RetVal BVTRangeProfile_Get_Y_Value(BVTRangeProfile self, int i, float* out) {
  return entry(self, i, out, [i](const RangeList& list) { return list.y_m(i); });
}
RetVal BVTRangeProfile_Get_Z_Value(BVTRangeProfile self, int i, float* out) {
  return entry(self, i, out, [](const RangeList&) { return 0; });
}

#endif
