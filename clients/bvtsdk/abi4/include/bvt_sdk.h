/* Our own C and C++ interface to sonars of the BlueView kind, compatible with the 4.x generation of the vendor's SDK; not the
 * vendor's header. Hosts include only this, as C99 or C++11, and link libbvtsdk.so.4. */
#pragma once

#include "bvt_sdk_codes.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BVT_API __attribute__((visibility("default")))

/* Handles. They are numbers, not addresses: never dereference them. Functions that destroy an object accept null. */
typedef struct BVTOpaqueSonar* BVTSonar;
typedef struct BVTOpaqueHead* BVTHead;
typedef struct BVTOpaquePing* BVTPing;
typedef struct BVTOpaqueMagImage* BVTMagImage;
typedef struct BVTOpaqueColorImage* BVTColorImage;
typedef struct BVTOpaqueColorMapper* BVTColorMapper;
typedef struct BVTOpaqueNavData* BVTNavData;
typedef struct BVTOpaqueSonarDiscoveryAgent* BVTSonarDiscoveryAgent;
typedef struct BVTOpaqueImageGenerator* BVTImageGenerator;
typedef struct BVTOpaqueRangeProfile* BVTRangeProfile;

/* Rows of an image: 256, 512, 1000, or as many as the ping has bins. */
enum {
  BVT_IMAGERES_OFF = 0,
  BVT_IMAGERES_LOW = 1,
  BVT_IMAGERES_MED = 2,
  BVT_IMAGERES_MEDIUM = 2,
  BVT_IMAGERES_HIGH = 3,
  BVT_IMAGERES_AUTO = 4
};

/* The layout of an image: Cartesian, or rows of equal range and columns of equal bearing. */
enum { BVT_IMAGETYPE_XY = 0, BVT_IMAGETYPE_RTHETA = 1 };

/* The fluid around the sonar. */
enum { BVT_FLUIDTYPE_SALTWATER = 0, BVT_FLUIDTYPE_FRESHWATER = 1, BVT_FLUIDTYPE_OTHER = 2 };

/* The place where the sonar is mounted. */
enum {
  BVT_MOUNTTYPE_UNKNOWN = 0,
  BVT_MOUNTTYPE_POLE = 1,
  BVT_MOUNTTYPE_TRIPOD = 2,
  BVT_MOUNTTYPE_ROV = 3,
  BVT_MOUNTTYPE_UUV = 4,
  BVT_MOUNTTYPE_OTHER = 5
};

/* Sonar: a live one, a recording that is played, or one that is being written. */
BVT_API BVTSonar BVTSonar_Create(void);
BVT_API void BVTSonar_Destroy(BVTSonar self);
BVT_API RetVal BVTSonar_Open(BVTSonar self, const char* type, const char* parameter); /* "NET", host; "FILE", path */
BVT_API RetVal BVTSonar_CreateFile(BVTSonar self, const char* file_name, BVTSonar source, const char* ignored);
BVT_API RetVal BVTSonar_GetHead(BVTSonar self, int number, BVTHead* out);
BVT_API RetVal BVTSonar_GetHeadCount(BVTSonar self, int* out);
BVT_API RetVal BVTSonar_GetTemperature(BVTSonar self, float* out);
BVT_API RetVal BVTSonar_GetFileSize(BVTSonar self, int* out);
BVT_API RetVal BVTSonar_GetSonarName(BVTSonar self, char* buffer, int buffer_size);
BVT_API RetVal BVTSonar_GetSerialNumber(BVTSonar self, char* buffer, int buffer_size);
BVT_API RetVal BVTSonar_GetSonarModelName(BVTSonar self, char* buffer, int buffer_size);
BVT_API RetVal BVTSonar_GetFirmwareRevision(BVTSonar self, char* buffer, int buffer_size);
BVT_API RetVal BVTSonar_SetTimestampsUseLocalClock(BVTSonar self, int on);
BVT_API RetVal BVTSonar_GetTimestampsUseLocalClock(BVTSonar self, int* out);
BVT_API RetVal BVTSonar_PutEventMark(BVTSonar self, const char* key, const char* text); /* at most 80 and 512 bytes */
BVT_API RetVal BVTSonar_SupportsMulticast(BVTSonar self, int* out);
BVT_API RetVal BVTSonar_GetNavDataCount(BVTSonar self, int* out);
BVT_API RetVal BVTSonar_GetTimeIndexedPingCount(BVTSonar self, int* out);
BVT_API RetVal BVTSonar_IsFile(BVTSonar self, int* out);
BVT_API RetVal BVTSonar_IsConnected(BVTSonar self, int* out);

/* Head: ranges in metres. On a live sonar, GetPing ignores the number, transmits a ping and waits for it. In a file, a negative
 * number means the next ping. */
BVT_API void BVTHead_Destroy(BVTHead self);
BVT_API RetVal BVTHead_SetRange(BVTHead self, float start_m, float stop_m);
BVT_API RetVal BVTHead_SetStartRange(BVTHead self, float start_m);
BVT_API RetVal BVTHead_SetStopRange(BVTHead self, float stop_m);
BVT_API RetVal BVTHead_GetStartRange(BVTHead self, float* out);
BVT_API RetVal BVTHead_GetStopRange(BVTHead self, float* out);
BVT_API RetVal BVTHead_GetMinimumRange(BVTHead self, float* out);
BVT_API RetVal BVTHead_GetMaximumRange(BVTHead self, float* out);
BVT_API RetVal BVTHead_SetSoundSpeed(BVTHead self, int metres_per_second);
BVT_API RetVal BVTHead_GetSoundSpeed(BVTHead self, int* out);
BVT_API RetVal BVTHead_SetGainAdjustment(BVTHead self, float db);
BVT_API RetVal BVTHead_GetGainAdjustment(BVTHead self, float* out);
BVT_API RetVal BVTHead_SetTVGSlope(BVTHead self, float db_per_m);
BVT_API RetVal BVTHead_GetTVGSlope(BVTHead self, float* out);
BVT_API RetVal BVTHead_SetFluidType(BVTHead self, int type);
BVT_API RetVal BVTHead_GetFluidType(BVTHead self, int* out);
BVT_API RetVal BVTHead_SetImageFilterFlags(BVTHead self, int flags);
BVT_API RetVal BVTHead_GetImageFilterFlags(BVTHead self, int* out);
BVT_API RetVal BVTHead_SetMountType(BVTHead self, int type);
BVT_API RetVal BVTHead_GetMountType(BVTHead self, int* out);
BVT_API RetVal BVTHead_GetCenterFreq(BVTHead self, int* out);
BVT_API RetVal BVTHead_GetPingCount(BVTHead self, int* out);
BVT_API RetVal BVTHead_GetImageProcessingMethod(BVTHead self, int* out);
BVT_API RetVal BVTHead_SetDynamicPowerManagement(BVTHead self, int on);
BVT_API RetVal BVTHead_GetDynamicPowerManagement(BVTHead self, int* out);
BVT_API RetVal BVTHead_SetPingInterval(BVTHead self, int milliseconds);
BVT_API RetVal BVTHead_GetPingInterval(BVTHead self, int* out);
BVT_API RetVal BVTHead_SetTxEnable(BVTHead self, int on);
BVT_API RetVal BVTHead_GetHeadName(BVTHead self, char* buffer, int buffer_size);
BVT_API RetVal BVTHead_GetPing(BVTHead self, int number, BVTPing* out);
BVT_API RetVal BVTHead_PutPing(BVTHead self, BVTPing ping);
BVT_API RetVal BVTHead_SetImageRes(BVTHead self, int resolution);
BVT_API RetVal BVTHead_SetImageType(BVTHead self, int type);
BVT_API RetVal BVTHead_SetImageReqSize(BVTHead self, int height, int width);
BVT_API RetVal BVTHead_SetRangeResolution(BVTHead self, float metres);

/* Ping: times are seconds since 1970 UTC. Another thread may use and destroy it. */
BVT_API void BVTPing_Destroy(BVTPing self);
BVT_API RetVal BVTPing_GetImage(BVTPing self, BVTMagImage* out);
BVT_API RetVal BVTPing_GetImageXY(BVTPing self, BVTMagImage* out);
BVT_API RetVal BVTPing_GetImageRTheta(BVTPing self, BVTMagImage* out);
BVT_API RetVal BVTPing_GetTimestamp(BVTPing self, double* out);
BVT_API RetVal BVTPing_GetTimeZoneOffset(BVTPing self, int* out);
BVT_API RetVal BVTPing_GetPingNumber(BVTPing self, int* out);
BVT_API RetVal BVTPing_GetFOV(BVTPing self, float* min_deg, float* max_deg);
BVT_API RetVal BVTPing_GetStartRange(BVTPing self, float* out);
BVT_API RetVal BVTPing_GetStopRange(BVTPing self, float* out);
BVT_API RetVal BVTPing_GetSoundSpeed(BVTPing self, int* out);
BVT_API RetVal BVTPing_HasNavData(BVTPing self, int* out);
BVT_API RetVal BVTPing_SetNavData(BVTPing self, BVTNavData nav);
BVT_API RetVal BVTPing_GetNavDataCopy(BVTPing self, BVTNavData* out);

/* ImageGenerator: makes images and range profiles of pings. Call SetHead first. Noise and clipping thresholds are fractions. */
BVT_API BVTImageGenerator BVTImageGenerator_Create(void);
BVT_API void BVTImageGenerator_Destroy(BVTImageGenerator self);
BVT_API RetVal BVTImageGenerator_SetHead(BVTImageGenerator self, BVTHead head);
BVT_API RetVal BVTImageGenerator_GetImageXY(BVTImageGenerator self, BVTPing ping, BVTMagImage* out);
BVT_API RetVal BVTImageGenerator_GetImageRTheta(BVTImageGenerator self, BVTPing ping, BVTMagImage* out);
BVT_API RetVal BVTImageGenerator_GetRangeProfile(BVTImageGenerator self, BVTPing ping, BVTRangeProfile* out);
BVT_API RetVal BVTImageGenerator_SetImageResolutionPolicy(BVTImageGenerator self, int resolution);
BVT_API RetVal BVTImageGenerator_GetImageResolutionPolicy(BVTImageGenerator self, int* out);
BVT_API RetVal BVTImageGenerator_SetRangeResolution(BVTImageGenerator self, float metres);
BVT_API RetVal BVTImageGenerator_GetRangeResolution(BVTImageGenerator self, float* out);
BVT_API RetVal BVTImageGenerator_SetRThetaImageWidth(BVTImageGenerator self, int columns);
BVT_API RetVal BVTImageGenerator_GetRThetaImageWidth(BVTImageGenerator self, int* out);
BVT_API RetVal BVTImageGenerator_SetImageFilterFlags(BVTImageGenerator self, int flags);
BVT_API RetVal BVTImageGenerator_GetImageFilterFlags(BVTImageGenerator self, int* out);
BVT_API RetVal BVTImageGenerator_SetNoiseThreshold(BVTImageGenerator self, float fraction);
BVT_API RetVal BVTImageGenerator_GetNoiseThreshold(BVTImageGenerator self, float* out);
BVT_API RetVal BVTImageGenerator_SetClippingThreshold(BVTImageGenerator self, float fraction);
BVT_API RetVal BVTImageGenerator_GetClippingThreshold(BVTImageGenerator self, float* out);
BVT_API RetVal BVTImageGenerator_SetSoundSpeedOverride(BVTImageGenerator self, int metres_per_second);
BVT_API RetVal BVTImageGenerator_GetSoundSpeedOverride(BVTImageGenerator self, int* out);
BVT_API RetVal BVTImageGenerator_SetRangeProfileIntensityThreshold(BVTImageGenerator self, unsigned short threshold);
BVT_API RetVal BVTImageGenerator_GetRangeProfileIntensityThreshold(BVTImageGenerator self, unsigned short* out);
BVT_API RetVal BVTImageGenerator_SetRangeProfileStartRange(BVTImageGenerator self, float metres);
BVT_API RetVal BVTImageGenerator_GetRangeProfileStartRange(BVTImageGenerator self, float* out);
BVT_API RetVal BVTImageGenerator_SetXYImageSize(BVTImageGenerator self, int width, int height);
BVT_API RetVal BVTImageGenerator_GetXYImageSize(BVTImageGenerator self, int* width, int* height);

/* MagImage: 16 bits per pixel, row after row, 65535 is full scale; angles in degrees clockwise from ahead. */
BVT_API void BVTMagImage_Destroy(BVTMagImage self);
BVT_API RetVal BVTMagImage_GetHeight(BVTMagImage self, int* out);
BVT_API RetVal BVTMagImage_GetWidth(BVTMagImage self, int* out);
BVT_API RetVal BVTMagImage_GetBits(BVTMagImage self, unsigned short** out);
BVT_API RetVal BVTMagImage_GetRow(BVTMagImage self, int row, unsigned short** out);
BVT_API RetVal BVTMagImage_GetPixel(BVTMagImage self, int row, int col, unsigned short* out);
BVT_API RetVal BVTMagImage_GetRangeResolution(BVTMagImage self, double* out);
BVT_API RetVal BVTMagImage_GetBearingResolution(BVTMagImage self, double* out);
BVT_API RetVal BVTMagImage_GetOriginRow(BVTMagImage self, int* out);
BVT_API RetVal BVTMagImage_GetOriginCol(BVTMagImage self, int* out);
BVT_API RetVal BVTMagImage_GetFOVMinAngle(BVTMagImage self, float* out);
BVT_API RetVal BVTMagImage_GetFOVMaxAngle(BVTMagImage self, float* out);
BVT_API RetVal BVTMagImage_GetPixelRange(BVTMagImage self, int row, int col, double* out);
BVT_API RetVal BVTMagImage_GetPixelRelativeBearing(BVTMagImage self, int row, int col, double* out);
BVT_API RetVal BVTMagImage_CopyBits(BVTMagImage self, unsigned short* buffer, unsigned int pixels);
BVT_API RetVal BVTMagImage_SavePGM(BVTMagImage self, const char* file_name);

/* ColorImage: 32 bits per pixel, in memory blue, green, red, 255. */
BVT_API void BVTColorImage_Destroy(BVTColorImage self);
BVT_API RetVal BVTColorImage_GetHeight(BVTColorImage self, int* out);
BVT_API RetVal BVTColorImage_GetWidth(BVTColorImage self, int* out);
BVT_API RetVal BVTColorImage_GetBits(BVTColorImage self, unsigned int** out);
BVT_API RetVal BVTColorImage_GetRow(BVTColorImage self, int row, unsigned int** out);
BVT_API RetVal BVTColorImage_GetPixel(BVTColorImage self, int row, int col, unsigned int* out);
BVT_API RetVal BVTColorImage_GetRangeResolution(BVTColorImage self, double* out);
BVT_API RetVal BVTColorImage_GetBearingResolution(BVTColorImage self, double* out);
BVT_API RetVal BVTColorImage_GetOriginRow(BVTColorImage self, int* out);
BVT_API RetVal BVTColorImage_GetOriginCol(BVTColorImage self, int* out);
BVT_API RetVal BVTColorImage_GetFOVMinAngle(BVTColorImage self, float* out);
BVT_API RetVal BVTColorImage_GetFOVMaxAngle(BVTColorImage self, float* out);
BVT_API RetVal BVTColorImage_GetPixelRange(BVTColorImage self, int row, int col, double* out);
BVT_API RetVal BVTColorImage_GetPixelRelativeBearing(BVTColorImage self, int row, int col, double* out);
BVT_API RetVal BVTColorImage_CopyBits(BVTColorImage self, unsigned int* buffer, unsigned int pixels);
BVT_API RetVal BVTColorImage_SavePPM(BVTColorImage self, const char* file_name);

/* ColorMapper: converts magnitudes to colours through a map of 4096 entries. */
BVT_API BVTColorMapper BVTColorMapper_Create(void);
BVT_API void BVTColorMapper_Destroy(BVTColorMapper self);
BVT_API RetVal BVTColorMapper_Load(BVTColorMapper self, const char* file_name);
BVT_API RetVal BVTColorMapper_MapImage(BVTColorMapper self, BVTMagImage image, BVTColorImage* out);
BVT_API RetVal BVTColorMapper_SetThresholds(BVTColorMapper self, int top, int bottom);
BVT_API RetVal BVTColorMapper_GetTopThreshold(BVTColorMapper self, int* out);
BVT_API RetVal BVTColorMapper_GetBottomThreshold(BVTColorMapper self, int* out);
BVT_API RetVal BVTColorMapper_SetGamma(BVTColorMapper self, float gamma);
BVT_API RetVal BVTColorMapper_GetGamma(BVTColorMapper self, float* out);
BVT_API RetVal BVTColorMapper_SetAutoMode(BVTColorMapper self, int on);
BVT_API RetVal BVTColorMapper_GetAutoMode(BVTColorMapper self, int* out);

/* RangeProfile: one range per bearing, left to right; metres and degrees clockwise from ahead. A range above 999 means no echo
 * above the threshold. The threshold is 10000 of 65535 unless BVTImageGenerator_SetRangeProfileIntensityThreshold sets another.
 */
BVT_API void BVTRangeProfile_Destroy(BVTRangeProfile self);
BVT_API RetVal BVTRangeProfile_GetCount(BVTRangeProfile self, int* out);
BVT_API RetVal BVTRangeProfile_GetValidCount(BVTRangeProfile self, int* out);
BVT_API RetVal BVTRangeProfile_CopyRangeValues(BVTRangeProfile self, float* buffer, int count);
BVT_API RetVal BVTRangeProfile_CopyBearingValues(BVTRangeProfile self, float* buffer, int count);
BVT_API RetVal BVTRangeProfile_CopyIntensityValues(BVTRangeProfile self, unsigned short* buffer, int count);
BVT_API RetVal BVTRangeProfile_GetRangeValue(BVTRangeProfile self, int i, float* out);
BVT_API RetVal BVTRangeProfile_GetBearingValue(BVTRangeProfile self, int i, float* out);
BVT_API RetVal BVTRangeProfile_GetIntensityValue(BVTRangeProfile self, int i, unsigned short* out);
BVT_API RetVal BVTRangeProfile_GetValidValue(BVTRangeProfile self, int i, int* out);
BVT_API RetVal BVTRangeProfile_Get_X_Value(BVTRangeProfile self, int i, float* out);
BVT_API RetVal BVTRangeProfile_Get_Y_Value(BVTRangeProfile self, int i, float* out);
BVT_API RetVal BVTRangeProfile_Get_Z_Value(BVTRangeProfile self, int i, float* out);

/* NavData: position and attitude of the vehicle. The getter of a value that was not set returns BVT_NAV_NO_DATA. */
BVT_API BVTNavData BVTNavData_Create(void);
BVT_API void BVTNavData_Destroy(BVTNavData self);
BVT_API RetVal BVTNavData_SetNavTime(BVTNavData self, double value); /* s since 1970 UTC */
BVT_API RetVal BVTNavData_GetNavTime(BVTNavData self, double* out);
BVT_API RetVal BVTNavData_SetLatitude(BVTNavData self, double value); /* degrees, north positive */
BVT_API RetVal BVTNavData_GetLatitude(BVTNavData self, double* out);
BVT_API RetVal BVTNavData_SetLongitude(BVTNavData self, double value); /* degrees, east positive */
BVT_API RetVal BVTNavData_GetLongitude(BVTNavData self, double* out);
BVT_API RetVal BVTNavData_SetDepth(BVTNavData self, float value); /* m */
BVT_API RetVal BVTNavData_GetDepth(BVTNavData self, float* out);
BVT_API RetVal BVTNavData_SetAltitude(BVTNavData self, float value); /* m above the bottom */
BVT_API RetVal BVTNavData_GetAltitude(BVTNavData self, float* out);
BVT_API RetVal BVTNavData_SetPitchAngle(BVTNavData self, float value); /* degrees, bow up */
BVT_API RetVal BVTNavData_GetPitchAngle(BVTNavData self, float* out);
BVT_API RetVal BVTNavData_SetRollAngle(BVTNavData self, float value); /* degrees, port up */
BVT_API RetVal BVTNavData_GetRollAngle(BVTNavData self, float* out);
BVT_API RetVal BVTNavData_SetHeading(BVTNavData self, float value); /* degrees clockwise from true north */
BVT_API RetVal BVTNavData_GetHeading(BVTNavData self, float* out);
BVT_API RetVal BVTNavData_SetHeadingVelocity(BVTNavData self, float value); /* m/s */
BVT_API RetVal BVTNavData_GetHeadingVelocity(BVTNavData self, float* out);
BVT_API RetVal BVTNavData_SetCourseOverGround(BVTNavData self, float value); /* degrees */
BVT_API RetVal BVTNavData_GetCourseOverGround(BVTNavData self, float* out);
BVT_API RetVal BVTNavData_SetUserNavString(BVTNavData self, const char* text); /* at most 80 bytes */
BVT_API RetVal BVTNavData_GetUserNavString(BVTNavData self, char* buffer, int buffer_size);

/* SonarDiscoveryAgent: finds sonars. They need a moment to answer, so wait between Start and counting. */
BVT_API BVTSonarDiscoveryAgent BVTSonarDiscoveryAgent_Create(void);
BVT_API void BVTSonarDiscoveryAgent_Destroy(BVTSonarDiscoveryAgent self);
BVT_API RetVal BVTSonarDiscoveryAgent_Start(BVTSonarDiscoveryAgent self);
BVT_API RetVal BVTSonarDiscoveryAgent_Stop(BVTSonarDiscoveryAgent self);
BVT_API RetVal BVTSonarDiscoveryAgent_GetSonarCount(BVTSonarDiscoveryAgent self, int* out);
BVT_API RetVal BVTSonarDiscoveryAgent_GetSonarInfo(BVTSonarDiscoveryAgent self, int i, char* buffer,
                                                   int buffer_size); /* its IPv4 address */

/* Errors, version, log. */
BVT_API const char* BVTError_GetString(RetVal code);
BVT_API const char* BVTError_GetName(RetVal code);
BVT_API void BVTSDK_Init(void);
BVT_API void BVTSDK_Shutdown(void);
BVT_API int BVTSDK_MajorVersion(void);
BVT_API int BVTSDK_MinorVersion(void);
BVT_API int BVTSDK_BuildNumber(void);
BVT_API RetVal BVTLogger_SetLevel(int level);           /* -1 none, 0 critical, 1 warning, 2 status */
BVT_API RetVal BVTLogger_SetTarget(const char* target); /* "stdout", "stderr", "null", or a file */

#ifdef __cplusplus
}

#if __cplusplus >= 201103L
#include "bvt_sdk_classes.h"
#endif
#endif
