/* The C++ classes of 4.x: each holds one handle and shares it when copied; a call that fails throws SdkException. C++11; part of
 * bvt_sdk.h. A method calls the C function of its name and returns the last out-parameter. */
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bvt_sdk.h"

namespace BVTSDK {

/* Hosts expect that this is not a std::exception. */
class SdkException {
 public:
  explicit SdkException(int code) : code_(code) {}
  int ReturnCode() const { return code_; }
  const std::string ErrorName() const { return BVTError_GetName(code_); }
  const std::string ErrorMessage() const { return BVTError_GetString(code_); }

 private:
  int code_;
};

namespace FluidType {
enum Enum { Saltwater = 0, Freshwater = 1, Other = 2 };
}
namespace ImageRes {
enum Enum { Off = 0, Low = 1, Medium = 2, High = 3, Auto = 4 };
}
namespace ImageType {
enum Enum { XY = 0, RTHETA = 1 };
}
namespace ImageFilterFlags {
enum Enum { None = 0, Mean3x3 = 2, Mean9x2 = 16 };
}
namespace MountType {
enum Enum { Unknown = 0, Pole = 1, Tripod = 2, ROV = 3, UUV = 4, Other = 5 };
}
namespace LogLevel {
enum Enum { None = -1, Critical = 0, Warning = 1, Status = 2 };
}

namespace detail {

inline void check(RetVal code) {
  if (code != BVT_SUCCESS) throw SdkException(code);
}

template <class T>
class Shared {
 public:
  T* Handle() const { return handle_.get(); }

 protected:
  Shared(T* handle, void (*destroy)(T*)) : handle_(handle, destroy) {}

 private:
  std::shared_ptr<T> handle_;
};

/* Calls f(handle, arguments..., &value) and returns the value. */
template <class V, class F, class... A>
V got(F f, A... arguments) {
  V value = V();
  check(f(arguments..., &value));
  return value;
}
template <class H, class V>
V get(RetVal (*f)(H, V*), H self) {
  return got<V>(f, self);
}
template <class H, class A, class V, class B>
V get(RetVal (*f)(H, A, V*), H self, B a) {
  return got<V>(f, self, a);
}
template <class H, class A, class B, class V, class C, class D>
V get(RetVal (*f)(H, A, B, V*), H self, C a, D b) {
  return got<V>(f, self, a, b);
}

/* Calls f(handle, arguments..., buffer, size) with a buffer that is large enough. */
template <class F, class... A>
std::string text(F f, A... arguments) {
  std::vector<char> buffer(256);
  RetVal code = f(arguments..., buffer.data(), static_cast<int>(buffer.size()));
  while (code == BVT_BUFFER_TOO_SMALL && buffer.size() < 100000) {
    buffer.resize(4 * buffer.size());
    code = f(arguments..., buffer.data(), static_cast<int>(buffer.size()));
  }
  check(code);
  return buffer.data();
}

} /* namespace detail */

class NavData : public detail::Shared<BVTOpaqueNavData> {
 public:
  NavData() : Shared(BVTNavData_Create(), BVTNavData_Destroy) {}
  NavData(BVTNavData handle) : Shared(handle, BVTNavData_Destroy) {}
  void SetNavTime(double value) const { detail::check(BVTNavData_SetNavTime(Handle(), value)); }
  double GetNavTime() const { return detail::get(BVTNavData_GetNavTime, Handle()); }
  void SetLatitude(double value) const { detail::check(BVTNavData_SetLatitude(Handle(), value)); }
  double GetLatitude() const { return detail::get(BVTNavData_GetLatitude, Handle()); }
  void SetLongitude(double value) const { detail::check(BVTNavData_SetLongitude(Handle(), value)); }
  double GetLongitude() const { return detail::get(BVTNavData_GetLongitude, Handle()); }
  void SetDepth(float value) const { detail::check(BVTNavData_SetDepth(Handle(), value)); }
  float GetDepth() const { return detail::get(BVTNavData_GetDepth, Handle()); }
  void SetAltitude(float value) const { detail::check(BVTNavData_SetAltitude(Handle(), value)); }
  float GetAltitude() const { return detail::get(BVTNavData_GetAltitude, Handle()); }
  void SetPitchAngle(float value) const { detail::check(BVTNavData_SetPitchAngle(Handle(), value)); }
  float GetPitchAngle() const { return detail::get(BVTNavData_GetPitchAngle, Handle()); }
  void SetRollAngle(float value) const { detail::check(BVTNavData_SetRollAngle(Handle(), value)); }
  float GetRollAngle() const { return detail::get(BVTNavData_GetRollAngle, Handle()); }
  void SetHeading(float value) const { detail::check(BVTNavData_SetHeading(Handle(), value)); }
  float GetHeading() const { return detail::get(BVTNavData_GetHeading, Handle()); }
  void SetHeadingVelocity(float value) const { detail::check(BVTNavData_SetHeadingVelocity(Handle(), value)); }
  float GetHeadingVelocity() const { return detail::get(BVTNavData_GetHeadingVelocity, Handle()); }
  void SetCourseOverGround(float value) const { detail::check(BVTNavData_SetCourseOverGround(Handle(), value)); }
  float GetCourseOverGround() const { return detail::get(BVTNavData_GetCourseOverGround, Handle()); }
  void SetUserNavString(const std::string& text) const { detail::check(BVTNavData_SetUserNavString(Handle(), text.c_str())); }
  std::string GetUserNavString() const { return detail::text(BVTNavData_GetUserNavString, Handle()); }
};

class MagImage : public detail::Shared<BVTOpaqueMagImage> {
 public:
  MagImage(BVTMagImage handle) : Shared(handle, BVTMagImage_Destroy) {}
  int GetHeight() const { return detail::get(BVTMagImage_GetHeight, Handle()); }
  int GetWidth() const { return detail::get(BVTMagImage_GetWidth, Handle()); }
  unsigned short* GetBits() const { return detail::get(BVTMagImage_GetBits, Handle()); }
  unsigned short* GetRow(int row) const { return detail::get(BVTMagImage_GetRow, Handle(), row); }
  unsigned short GetPixel(int row, int col) const { return detail::get(BVTMagImage_GetPixel, Handle(), row, col); }
  double GetRangeResolution() const { return detail::get(BVTMagImage_GetRangeResolution, Handle()); }
  double GetBearingResolution() const { return detail::get(BVTMagImage_GetBearingResolution, Handle()); }
  int GetOriginRow() const { return detail::get(BVTMagImage_GetOriginRow, Handle()); }
  int GetOriginCol() const { return detail::get(BVTMagImage_GetOriginCol, Handle()); }
  float GetFOVMinAngle() const { return detail::get(BVTMagImage_GetFOVMinAngle, Handle()); }
  float GetFOVMaxAngle() const { return detail::get(BVTMagImage_GetFOVMaxAngle, Handle()); }
  double GetPixelRange(int row, int col) const { return detail::get(BVTMagImage_GetPixelRange, Handle(), row, col); }
  double GetPixelRelativeBearing(int row, int col) const {
    return detail::get(BVTMagImage_GetPixelRelativeBearing, Handle(), row, col);
  }
  void CopyBits(unsigned short* buffer, unsigned int pixels) const {
    detail::check(BVTMagImage_CopyBits(Handle(), buffer, pixels));
  }
  void SavePGM(const std::string& file_name) const { detail::check(BVTMagImage_SavePGM(Handle(), file_name.c_str())); }
};

class ColorImage : public detail::Shared<BVTOpaqueColorImage> {
 public:
  ColorImage(BVTColorImage handle) : Shared(handle, BVTColorImage_Destroy) {}
  int GetHeight() const { return detail::get(BVTColorImage_GetHeight, Handle()); }
  int GetWidth() const { return detail::get(BVTColorImage_GetWidth, Handle()); }
  unsigned int* GetBits() const { return detail::get(BVTColorImage_GetBits, Handle()); }
  unsigned int* GetRow(int row) const { return detail::get(BVTColorImage_GetRow, Handle(), row); }
  unsigned int GetPixel(int row, int col) const { return detail::get(BVTColorImage_GetPixel, Handle(), row, col); }
  double GetRangeResolution() const { return detail::get(BVTColorImage_GetRangeResolution, Handle()); }
  double GetBearingResolution() const { return detail::get(BVTColorImage_GetBearingResolution, Handle()); }
  int GetOriginRow() const { return detail::get(BVTColorImage_GetOriginRow, Handle()); }
  int GetOriginCol() const { return detail::get(BVTColorImage_GetOriginCol, Handle()); }
  float GetFOVMinAngle() const { return detail::get(BVTColorImage_GetFOVMinAngle, Handle()); }
  float GetFOVMaxAngle() const { return detail::get(BVTColorImage_GetFOVMaxAngle, Handle()); }
  double GetPixelRange(int row, int col) const { return detail::get(BVTColorImage_GetPixelRange, Handle(), row, col); }
  double GetPixelRelativeBearing(int row, int col) const {
    return detail::get(BVTColorImage_GetPixelRelativeBearing, Handle(), row, col);
  }
  void CopyBits(unsigned int* buffer, unsigned int pixels) const {
    detail::check(BVTColorImage_CopyBits(Handle(), buffer, pixels));
  }
  void SavePPM(const std::string& file_name) const { detail::check(BVTColorImage_SavePPM(Handle(), file_name.c_str())); }
};

class RangeProfile : public detail::Shared<BVTOpaqueRangeProfile> {
 public:
  RangeProfile(BVTRangeProfile handle) : Shared(handle, BVTRangeProfile_Destroy) {}
  int GetCount() const { return detail::get(BVTRangeProfile_GetCount, Handle()); }
  int GetValidCount() const { return detail::get(BVTRangeProfile_GetValidCount, Handle()); }
  void CopyRangeValues(float* buffer, int count) const {
    detail::check(BVTRangeProfile_CopyRangeValues(Handle(), buffer, count));
  }
  void CopyBearingValues(float* buffer, int count) const {
    detail::check(BVTRangeProfile_CopyBearingValues(Handle(), buffer, count));
  }
  void CopyIntensityValues(unsigned short* buffer, int count) const {
    detail::check(BVTRangeProfile_CopyIntensityValues(Handle(), buffer, count));
  }
  float GetRangeValue(int i) const { return detail::get(BVTRangeProfile_GetRangeValue, Handle(), i); }
  float GetBearingValue(int i) const { return detail::get(BVTRangeProfile_GetBearingValue, Handle(), i); }
  unsigned short GetIntensityValue(int i) const { return detail::get(BVTRangeProfile_GetIntensityValue, Handle(), i); }
  bool GetValidValue(int i) const { return detail::get(BVTRangeProfile_GetValidValue, Handle(), i) != 0; }
  float Get_X_Value(int i) const { return detail::get(BVTRangeProfile_Get_X_Value, Handle(), i); }
  float Get_Y_Value(int i) const { return detail::get(BVTRangeProfile_Get_Y_Value, Handle(), i); }
  float Get_Z_Value(int i) const { return detail::get(BVTRangeProfile_Get_Z_Value, Handle(), i); }
};

class ColorMapper : public detail::Shared<BVTOpaqueColorMapper> {
 public:
  ColorMapper() : Shared(BVTColorMapper_Create(), BVTColorMapper_Destroy) {}
  ColorMapper(BVTColorMapper handle) : Shared(handle, BVTColorMapper_Destroy) {}
  void Load(const std::string& file_name) const { detail::check(BVTColorMapper_Load(Handle(), file_name.c_str())); }
  ColorImage MapImage(const MagImage& image) const { return detail::get(BVTColorMapper_MapImage, Handle(), image.Handle()); }
  void SetThresholds(int top, int bottom) const { detail::check(BVTColorMapper_SetThresholds(Handle(), top, bottom)); }
  int GetTopThreshold() const { return detail::get(BVTColorMapper_GetTopThreshold, Handle()); }
  int GetBottomThreshold() const { return detail::get(BVTColorMapper_GetBottomThreshold, Handle()); }
  void SetGamma(float gamma) const { detail::check(BVTColorMapper_SetGamma(Handle(), gamma)); }
  float GetGamma() const { return detail::get(BVTColorMapper_GetGamma, Handle()); }
  void SetAutoMode(bool on) const { detail::check(BVTColorMapper_SetAutoMode(Handle(), on ? 1 : 0)); }
  bool GetAutoMode() const { return detail::get(BVTColorMapper_GetAutoMode, Handle()) != 0; }
};

class Ping : public detail::Shared<BVTOpaquePing> {
 public:
  Ping(BVTPing handle) : Shared(handle, BVTPing_Destroy) {}
  MagImage GetImage() const { return detail::get(BVTPing_GetImage, Handle()); }
  MagImage GetImageXY() const { return detail::get(BVTPing_GetImageXY, Handle()); }
  MagImage GetImageRTheta() const { return detail::get(BVTPing_GetImageRTheta, Handle()); }
  double GetTimestamp() const { return detail::get(BVTPing_GetTimestamp, Handle()); }
  int GetTimeZoneOffset() const { return detail::get(BVTPing_GetTimeZoneOffset, Handle()); }
  int GetPingNumber() const { return detail::get(BVTPing_GetPingNumber, Handle()); }
  void GetFOV(float* min_deg, float* max_deg) const { detail::check(BVTPing_GetFOV(Handle(), min_deg, max_deg)); }
  float GetStartRange() const { return detail::get(BVTPing_GetStartRange, Handle()); }
  float GetStopRange() const { return detail::get(BVTPing_GetStopRange, Handle()); }
  int GetSoundSpeed() const { return detail::get(BVTPing_GetSoundSpeed, Handle()); }
  bool HasNavData() const { return detail::get(BVTPing_HasNavData, Handle()) != 0; }
  void SetNavData(const NavData& nav) const { detail::check(BVTPing_SetNavData(Handle(), nav.Handle())); }
  NavData GetNavDataCopy() const { return detail::get(BVTPing_GetNavDataCopy, Handle()); }
};

class Head : public detail::Shared<BVTOpaqueHead> {
 public:
  Head(BVTHead handle) : Shared(handle, BVTHead_Destroy) {}
  void SetRange(float start_m, float stop_m) const { detail::check(BVTHead_SetRange(Handle(), start_m, stop_m)); }
  void SetStartRange(float start_m) const { detail::check(BVTHead_SetStartRange(Handle(), start_m)); }
  void SetStopRange(float stop_m) const { detail::check(BVTHead_SetStopRange(Handle(), stop_m)); }
  float GetStartRange() const { return detail::get(BVTHead_GetStartRange, Handle()); }
  float GetStopRange() const { return detail::get(BVTHead_GetStopRange, Handle()); }
  float GetMinimumRange() const { return detail::get(BVTHead_GetMinimumRange, Handle()); }
  float GetMaximumRange() const { return detail::get(BVTHead_GetMaximumRange, Handle()); }
  void SetSoundSpeed(int metres_per_second) const { detail::check(BVTHead_SetSoundSpeed(Handle(), metres_per_second)); }
  int GetSoundSpeed() const { return detail::get(BVTHead_GetSoundSpeed, Handle()); }
  void SetGainAdjustment(float db) const { detail::check(BVTHead_SetGainAdjustment(Handle(), db)); }
  float GetGainAdjustment() const { return detail::get(BVTHead_GetGainAdjustment, Handle()); }
  void SetTVGSlope(float db_per_m) const { detail::check(BVTHead_SetTVGSlope(Handle(), db_per_m)); }
  float GetTVGSlope() const { return detail::get(BVTHead_GetTVGSlope, Handle()); }
  void SetFluidType(FluidType::Enum type) const { detail::check(BVTHead_SetFluidType(Handle(), type)); }
  FluidType::Enum GetFluidType() const { return static_cast<FluidType::Enum>(detail::get(BVTHead_GetFluidType, Handle())); }
  void SetImageFilterFlags(ImageFilterFlags::Enum flags) const { detail::check(BVTHead_SetImageFilterFlags(Handle(), flags)); }
  ImageFilterFlags::Enum GetImageFilterFlags() const {
    return static_cast<ImageFilterFlags::Enum>(detail::get(BVTHead_GetImageFilterFlags, Handle()));
  }
  void SetMountType(MountType::Enum type) const { detail::check(BVTHead_SetMountType(Handle(), type)); }
  MountType::Enum GetMountType() const { return static_cast<MountType::Enum>(detail::get(BVTHead_GetMountType, Handle())); }
  int GetCenterFreq() const { return detail::get(BVTHead_GetCenterFreq, Handle()); }
  int GetPingCount() const { return detail::get(BVTHead_GetPingCount, Handle()); }
  int GetImageProcessingMethod() const { return detail::get(BVTHead_GetImageProcessingMethod, Handle()); }
  void SetDynamicPowerManagement(bool on) const { detail::check(BVTHead_SetDynamicPowerManagement(Handle(), on ? 1 : 0)); }
  bool GetDynamicPowerManagement() const { return detail::get(BVTHead_GetDynamicPowerManagement, Handle()) != 0; }
  void SetPingInterval(int milliseconds) const { detail::check(BVTHead_SetPingInterval(Handle(), milliseconds)); }
  int GetPingInterval() const { return detail::get(BVTHead_GetPingInterval, Handle()); }
  void SetTxEnable(bool on) const { detail::check(BVTHead_SetTxEnable(Handle(), on ? 1 : 0)); }
  std::string GetHeadName() const { return detail::text(BVTHead_GetHeadName, Handle()); }
  Ping GetPing(int number) const { return detail::get(BVTHead_GetPing, Handle(), number); }
  void PutPing(const Ping& ping) const { detail::check(BVTHead_PutPing(Handle(), ping.Handle())); }
  void SetImageRes(ImageRes::Enum resolution) const { detail::check(BVTHead_SetImageRes(Handle(), resolution)); }
  void SetImageType(ImageType::Enum type) const { detail::check(BVTHead_SetImageType(Handle(), type)); }
  void SetImageReqSize(int height, int width) const { detail::check(BVTHead_SetImageReqSize(Handle(), height, width)); }
  void SetRangeResolution(float metres) const { detail::check(BVTHead_SetRangeResolution(Handle(), metres)); }
};

class Sonar : public detail::Shared<BVTOpaqueSonar> {
 public:
  Sonar() : Shared(BVTSonar_Create(), BVTSonar_Destroy) {}
  Sonar(BVTSonar handle) : Shared(handle, BVTSonar_Destroy) {}
  void Open(const std::string& type, const std::string& parameter) const {
    detail::check(BVTSonar_Open(Handle(), type.c_str(), parameter.c_str()));
  }
  void CreateFile(const std::string& file_name, const Sonar& source, const std::string& ignored) const {
    detail::check(BVTSonar_CreateFile(Handle(), file_name.c_str(), source.Handle(), ignored.c_str()));
  }
  Head GetHead(int number) const { return detail::get(BVTSonar_GetHead, Handle(), number); }
  int GetHeadCount() const { return detail::get(BVTSonar_GetHeadCount, Handle()); }
  float GetTemperature() const { return detail::get(BVTSonar_GetTemperature, Handle()); }
  int GetFileSize() const { return detail::get(BVTSonar_GetFileSize, Handle()); }
  std::string GetSonarName() const { return detail::text(BVTSonar_GetSonarName, Handle()); }
  std::string GetSerialNumber() const { return detail::text(BVTSonar_GetSerialNumber, Handle()); }
  std::string GetSonarModelName() const { return detail::text(BVTSonar_GetSonarModelName, Handle()); }
  std::string GetFirmwareRevision() const { return detail::text(BVTSonar_GetFirmwareRevision, Handle()); }
  void SetTimestampsUseLocalClock(bool on) const { detail::check(BVTSonar_SetTimestampsUseLocalClock(Handle(), on ? 1 : 0)); }
  bool GetTimestampsUseLocalClock() const { return detail::get(BVTSonar_GetTimestampsUseLocalClock, Handle()) != 0; }
  void PutEventMark(const std::string& key, const std::string& text) const {
    detail::check(BVTSonar_PutEventMark(Handle(), key.c_str(), text.c_str()));
  }
  bool SupportsMulticast() const { return detail::get(BVTSonar_SupportsMulticast, Handle()) != 0; }
  int GetNavDataCount() const { return detail::get(BVTSonar_GetNavDataCount, Handle()); }
  int GetTimeIndexedPingCount() const { return detail::get(BVTSonar_GetTimeIndexedPingCount, Handle()); }
  bool IsFile() const { return detail::get(BVTSonar_IsFile, Handle()) != 0; }
  bool IsConnected() const { return detail::get(BVTSonar_IsConnected, Handle()) != 0; }
};

class ImageGenerator : public detail::Shared<BVTOpaqueImageGenerator> {
 public:
  ImageGenerator() : Shared(BVTImageGenerator_Create(), BVTImageGenerator_Destroy) {}
  ImageGenerator(BVTImageGenerator handle) : Shared(handle, BVTImageGenerator_Destroy) {}
  void SetHead(const Head& head) const { detail::check(BVTImageGenerator_SetHead(Handle(), head.Handle())); }
  MagImage GetImageXY(const Ping& ping) const { return detail::get(BVTImageGenerator_GetImageXY, Handle(), ping.Handle()); }
  MagImage GetImageRTheta(const Ping& ping) const {
    return detail::get(BVTImageGenerator_GetImageRTheta, Handle(), ping.Handle());
  }
  RangeProfile GetRangeProfile(const Ping& ping) const {
    return detail::get(BVTImageGenerator_GetRangeProfile, Handle(), ping.Handle());
  }
  void SetImageResolutionPolicy(ImageRes::Enum resolution) const {
    detail::check(BVTImageGenerator_SetImageResolutionPolicy(Handle(), resolution));
  }
  ImageRes::Enum GetImageResolutionPolicy() const {
    return static_cast<ImageRes::Enum>(detail::get(BVTImageGenerator_GetImageResolutionPolicy, Handle()));
  }
  void SetRangeResolution(float metres) const { detail::check(BVTImageGenerator_SetRangeResolution(Handle(), metres)); }
  float GetRangeResolution() const { return detail::get(BVTImageGenerator_GetRangeResolution, Handle()); }
  void SetRThetaImageWidth(int columns) const { detail::check(BVTImageGenerator_SetRThetaImageWidth(Handle(), columns)); }
  int GetRThetaImageWidth() const { return detail::get(BVTImageGenerator_GetRThetaImageWidth, Handle()); }
  void SetImageFilterFlags(ImageFilterFlags::Enum flags) const {
    detail::check(BVTImageGenerator_SetImageFilterFlags(Handle(), flags));
  }
  ImageFilterFlags::Enum GetImageFilterFlags() const {
    return static_cast<ImageFilterFlags::Enum>(detail::get(BVTImageGenerator_GetImageFilterFlags, Handle()));
  }
  void SetNoiseThreshold(float fraction) const { detail::check(BVTImageGenerator_SetNoiseThreshold(Handle(), fraction)); }
  float GetNoiseThreshold() const { return detail::get(BVTImageGenerator_GetNoiseThreshold, Handle()); }
  void SetClippingThreshold(float fraction) const { detail::check(BVTImageGenerator_SetClippingThreshold(Handle(), fraction)); }
  float GetClippingThreshold() const { return detail::get(BVTImageGenerator_GetClippingThreshold, Handle()); }
  void SetSoundSpeedOverride(int metres_per_second) const {
    detail::check(BVTImageGenerator_SetSoundSpeedOverride(Handle(), metres_per_second));
  }
  int GetSoundSpeedOverride() const { return detail::get(BVTImageGenerator_GetSoundSpeedOverride, Handle()); }
  void SetRangeProfileIntensityThreshold(unsigned short threshold) const {
    detail::check(BVTImageGenerator_SetRangeProfileIntensityThreshold(Handle(), threshold));
  }
  unsigned short GetRangeProfileIntensityThreshold() const {
    return detail::get(BVTImageGenerator_GetRangeProfileIntensityThreshold, Handle());
  }
  void SetRangeProfileStartRange(float metres) const {
    detail::check(BVTImageGenerator_SetRangeProfileStartRange(Handle(), metres));
  }
  float GetRangeProfileStartRange() const { return detail::get(BVTImageGenerator_GetRangeProfileStartRange, Handle()); }
  void SetXYImageSize(int width, int height) const { detail::check(BVTImageGenerator_SetXYImageSize(Handle(), width, height)); }
  void GetXYImageSize(int* width, int* height) const { detail::check(BVTImageGenerator_GetXYImageSize(Handle(), width, height)); }
};

class SonarDiscoveryAgent : public detail::Shared<BVTOpaqueSonarDiscoveryAgent> {
 public:
  SonarDiscoveryAgent() : Shared(BVTSonarDiscoveryAgent_Create(), BVTSonarDiscoveryAgent_Destroy) {}
  SonarDiscoveryAgent(BVTSonarDiscoveryAgent handle) : Shared(handle, BVTSonarDiscoveryAgent_Destroy) {}
  void Start() const { detail::check(BVTSonarDiscoveryAgent_Start(Handle())); }
  void Stop() const { detail::check(BVTSonarDiscoveryAgent_Stop(Handle())); }
  int GetSonarCount() const { return detail::get(BVTSonarDiscoveryAgent_GetSonarCount, Handle()); }
  std::string GetSonarInfo(int i) const { return detail::text(BVTSonarDiscoveryAgent_GetSonarInfo, Handle(), i); }
};

class Error {
 public:
  static std::string GetString(RetVal code) { return BVTError_GetString(code); }
  static std::string GetName(RetVal code) { return BVTError_GetName(code); }
};

class SDK {
 public:
  static void Init() { BVTSDK_Init(); }
  static void Shutdown() { BVTSDK_Shutdown(); }
  static int MajorVersion() { return BVTSDK_MajorVersion(); }
  static int MinorVersion() { return BVTSDK_MinorVersion(); }
  static int BuildNumber() { return BVTSDK_BuildNumber(); }
};

class Logger {
 public:
  static void SetLevel(LogLevel::Enum level) { detail::check(BVTLogger_SetLevel(level)); }
  static void SetTarget(const std::string& target) { detail::check(BVTLogger_SetTarget(target.c_str())); }
};

} /* namespace BVTSDK */
