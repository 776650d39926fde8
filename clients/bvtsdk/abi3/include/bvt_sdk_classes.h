/* The C++ layer that 3.x hosts use: range data that converts to its handle. C++98; part of bvt_sdk.h. */
#pragma once

#include "bvt_sdk.h"

namespace BVTSDK {

/* Pass it to BVTPing_GetRangeData as the pointer to a handle, then read it. The range data belong to the ping. */
class RangeData {
 public:
  RangeData() : handle_(0) {}
  RangeData(BVTRangeData handle) : handle_(handle) {}

  operator BVTRangeData() const { return handle_; }
  operator BVTRangeData*() { return &handle_; }
  BVTRangeData Handle() const { return handle_; }

  int GetCount() const { return BVTRangeData_GetCount(handle_); }
  float GetRangeValue(int i) const { return BVTRangeData_GetRangeValue(handle_, i); }
  float GetBearingValue(int i) const { return BVTRangeData_GetBearingValue(handle_, i); }
  unsigned short GetIntensityValue(int i) const { return BVTRangeData_GetIntensityValue(handle_, i); }
  float GetFOVMinAngle() const { return BVTRangeData_GetFOVMinAngle(handle_); }
  float GetFOVMaxAngle() const { return BVTRangeData_GetFOVMaxAngle(handle_); }
  double GetRangeResolution() const { return BVTRangeData_GetRangeResolution(handle_); }
  double GetBearingResolution() const { return BVTRangeData_GetBearingResolution(handle_); }
  RetVal CopyRangeValues(float* buffer, int count) const { return BVTRangeData_CopyRangeValues(handle_, buffer, count); }

 private:
  BVTRangeData handle_;
};

} /* namespace BVTSDK */
