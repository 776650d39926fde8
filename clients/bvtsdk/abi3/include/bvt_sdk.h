/* Our own C and C++ interface to sonars of the BlueView kind, compatible with the 3.x generation of the vendor's SDK; not the
 * vendor's header. Hosts include only this, as C99 or C++98, and link libbvtsdk.so.3. */
#pragma once

#include "bvt_sdk_codes.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BVT_API __attribute__((visibility("default")))

/* Handles. They are numbers, not addresses: never dereference them. Functions that destroy an object accept null. All handles
 * have one pointer type, because handles of the earlier 3.x were all void*, and its hosts may keep one kind in a variable of
 * another. Calls return BVT_INVALID_PTR for a handle of the wrong kind. Hosts of the later 3.x use the names of the structs. */
typedef struct BVTOpaqueHandle BVTOpaqueSonar, BVTOpaqueHead, BVTOpaquePing, BVTOpaqueMagImage, BVTOpaqueColorImage,
    BVTOpaqueColorMapper, BVTOpaqueNavData, BVTOpaqueSonarDiscoveryAgent, BVTOpaqueRangeData;
typedef BVTOpaqueSonar* BVTSonar;
typedef BVTOpaqueHead* BVTHead;
typedef BVTOpaquePing* BVTPing;
typedef BVTOpaqueMagImage* BVTMagImage;
typedef BVTOpaqueColorImage* BVTColorImage;
typedef BVTOpaqueColorMapper* BVTColorMapper;
typedef BVTOpaqueNavData* BVTNavData;
typedef BVTOpaqueSonarDiscoveryAgent* BVTSonarDiscoveryAgent;
typedef BVTOpaqueRangeData* BVTRangeData;

/* Rows of an image: 256, 512, 1000, or as many as the ping has bins. */
enum {
  BVTHEAD_RES_OFF = 0,
  BVTHEAD_RES_LOW = 1,
  BVTHEAD_RES_MED = 2,
  BVTHEAD_RES_MEDIUM = 2,
  BVTHEAD_RES_HIGH = 3,
  BVTHEAD_RES_AUTO = 4
};

/* The layout of an image: Cartesian, or rows of equal range and columns of equal bearing. */
enum { BVTHEAD_IMAGE_XY = 0, BVTHEAD_IMAGE_RTHETA = 1 };

/* The fluid around the sonar. */
enum { BVTHEAD_FLUID_SALTWATER = 0, BVTHEAD_FLUID_FRESHWATER = 1, BVTHEAD_FLUID_OTHER = 2 };

/* Sonar: a live one, a recording that is played, or one that is being written. Heads belong to it. */
BVT_API BVTSonar BVTSonar_Create(void);
BVT_API void BVTSonar_Destroy(BVTSonar self);
BVT_API RetVal BVTSonar_Open(BVTSonar self, const char* type, const char* parameter); /* "NET", host; "FILE", path */
BVT_API RetVal BVTSonar_CreateFile(BVTSonar self, const char* file_name, BVTSonar source, const char* ignored);
BVT_API RetVal BVTSonar_GetHead(BVTSonar self, int number, BVTHead* out);
BVT_API int BVTSonar_GetHeadCount(BVTSonar self);
BVT_API float BVTSonar_GetTemperature(BVTSonar self);
BVT_API int BVTSonar_GetFileSize(BVTSonar self);
BVT_API RetVal BVTSonar_GetSonarName(BVTSonar self, char* buffer, int buffer_size);
BVT_API RetVal BVTSonar_GetSerialNumber(BVTSonar self, char* buffer, int buffer_size);
BVT_API RetVal BVTSonar_GetSonarTypeAsString(BVTSonar self, char* buffer, int buffer_size);

/* Head: ranges in metres. On a live sonar, GetPing ignores the number, transmits a ping and waits for it. In a file, a negative
 * number means the next ping. */
BVT_API RetVal BVTHead_SetRange(BVTHead self, float start_m, float stop_m);
BVT_API float BVTHead_GetStartRange(BVTHead self);
BVT_API float BVTHead_GetStopRange(BVTHead self);
BVT_API float BVTHead_GetMinimumRange(BVTHead self);
BVT_API float BVTHead_GetMaximumRange(BVTHead self);
BVT_API RetVal BVTHead_SetSoundSpeed(BVTHead self, int metres_per_second);
BVT_API int BVTHead_GetSoundSpeed(BVTHead self);
BVT_API RetVal BVTHead_SetGainAdjustment(BVTHead self, float db);
BVT_API float BVTHead_GetGainAdjustment(BVTHead self);
BVT_API RetVal BVTHead_SetTVGSlope(BVTHead self, float db_per_m);
BVT_API float BVTHead_GetTVGSlope(BVTHead self);
BVT_API RetVal BVTHead_SetFluidType(BVTHead self, int type);
BVT_API int BVTHead_GetFluidType(BVTHead self);
BVT_API RetVal BVTHead_SetImageFilterFlags(BVTHead self, int flags);
BVT_API int BVTHead_GetImageFilterFlags(BVTHead self);
BVT_API RetVal BVTHead_SetMountType(BVTHead self, int type);
BVT_API int BVTHead_GetMountType(BVTHead self);
BVT_API int BVTHead_GetCenterFreq(BVTHead self);
BVT_API int BVTHead_GetPingCount(BVTHead self);
BVT_API int BVTHead_GetImageProcessingMethod(BVTHead self);
BVT_API RetVal BVTHead_SetTxEnable(BVTHead self, int on);
BVT_API RetVal BVTHead_GetHeadName(BVTHead self, char* buffer, int buffer_size);
BVT_API RetVal BVTHead_GetPing(BVTHead self, int number, BVTPing* out);
BVT_API RetVal BVTHead_PutPing(BVTHead self, BVTPing ping);
BVT_API RetVal BVTHead_SetImageRes(BVTHead self, int resolution);
BVT_API RetVal BVTHead_SetImageType(BVTHead self, int type);
BVT_API RetVal BVTHead_SetImageReqSize(BVTHead self, int height, int width);
BVT_API RetVal BVTHead_SetRangeResolution(BVTHead self, float metres);
BVT_API RetVal BVTHead_SetRangeDataThreshold(BVTHead self, unsigned short threshold);

/* Ping: times are seconds since 1970 UTC. Another thread may use and destroy it. */
BVT_API void BVTPing_Destroy(BVTPing self);
BVT_API RetVal BVTPing_GetImage(BVTPing self, BVTMagImage* out);
BVT_API RetVal BVTPing_GetImageXY(BVTPing self, BVTMagImage* out);
BVT_API RetVal BVTPing_GetImageRTheta(BVTPing self, BVTMagImage* out);
BVT_API RetVal BVTPing_GetRangeData(BVTPing self, BVTRangeData* out); /* belongs to the ping */
BVT_API double BVTPing_GetTimestamp(BVTPing self);
BVT_API int BVTPing_GetTimeZoneOffset(BVTPing self);
BVT_API int BVTPing_GetPingNumber(BVTPing self);
BVT_API RetVal BVTPing_PutNavData(BVTPing self, BVTNavData nav);
BVT_API RetVal BVTPing_GetNavDataCopy(BVTPing self, BVTNavData* out);

/* MagImage: 16 bits per pixel, row after row, 65535 is full scale; angles in degrees clockwise from ahead. */
BVT_API void BVTMagImage_Destroy(BVTMagImage self);
BVT_API int BVTMagImage_GetHeight(BVTMagImage self);
BVT_API int BVTMagImage_GetWidth(BVTMagImage self);
BVT_API unsigned short* BVTMagImage_GetBits(BVTMagImage self);
BVT_API unsigned short* BVTMagImage_GetRow(BVTMagImage self, int row);
BVT_API unsigned short BVTMagImage_GetPixel(BVTMagImage self, int row, int col);
BVT_API double BVTMagImage_GetRangeResolution(BVTMagImage self);
BVT_API double BVTMagImage_GetBearingResolution(BVTMagImage self);
BVT_API int BVTMagImage_GetOriginRow(BVTMagImage self);
BVT_API int BVTMagImage_GetOriginCol(BVTMagImage self);
BVT_API double BVTMagImage_GetFOVMinAngle(BVTMagImage self);
BVT_API double BVTMagImage_GetFOVMaxAngle(BVTMagImage self);
BVT_API double BVTMagImage_GetPixelRange(BVTMagImage self, int row, int col);
BVT_API double BVTMagImage_GetPixelRelativeBearing(BVTMagImage self, int row, int col);
BVT_API RetVal BVTMagImage_CopyBits(BVTMagImage self, unsigned short* buffer, unsigned int pixels);
BVT_API RetVal BVTMagImage_SavePGM(BVTMagImage self, const char* file_name);

/* ColorImage: 32 bits per pixel, in memory blue, green, red, 255. */
BVT_API void BVTColorImage_Destroy(BVTColorImage self);
BVT_API int BVTColorImage_GetHeight(BVTColorImage self);
BVT_API int BVTColorImage_GetWidth(BVTColorImage self);
BVT_API unsigned int* BVTColorImage_GetBits(BVTColorImage self);
BVT_API unsigned int* BVTColorImage_GetRow(BVTColorImage self, int row);
BVT_API unsigned int BVTColorImage_GetPixel(BVTColorImage self, int row, int col);
BVT_API double BVTColorImage_GetRangeResolution(BVTColorImage self);
BVT_API double BVTColorImage_GetBearingResolution(BVTColorImage self);
BVT_API int BVTColorImage_GetOriginRow(BVTColorImage self);
BVT_API int BVTColorImage_GetOriginCol(BVTColorImage self);
BVT_API double BVTColorImage_GetFOVMinAngle(BVTColorImage self);
BVT_API double BVTColorImage_GetFOVMaxAngle(BVTColorImage self);
BVT_API double BVTColorImage_GetPixelRange(BVTColorImage self, int row, int col);
BVT_API double BVTColorImage_GetPixelRelativeBearing(BVTColorImage self, int row, int col);
BVT_API RetVal BVTColorImage_CopyBits(BVTColorImage self, unsigned int* buffer, unsigned int pixels);
BVT_API RetVal BVTColorImage_SavePPM(BVTColorImage self, const char* file_name);

/* ColorMapper: converts magnitudes to colours through a map of 4096 entries. */
BVT_API BVTColorMapper BVTColorMapper_Create(void);
BVT_API void BVTColorMapper_Destroy(BVTColorMapper self);
BVT_API RetVal BVTColorMapper_Load(BVTColorMapper self, const char* file_name);
BVT_API RetVal BVTColorMapper_MapImage(BVTColorMapper self, BVTMagImage image, BVTColorImage* out);
BVT_API RetVal BVTColorMapper_SetThresholds(BVTColorMapper self, int top, int bottom);
BVT_API int BVTColorMapper_GetTopThreshold(BVTColorMapper self);
BVT_API int BVTColorMapper_GetBottomThreshold(BVTColorMapper self);
BVT_API RetVal BVTColorMapper_SetGamma(BVTColorMapper self, float gamma);
BVT_API float BVTColorMapper_GetGamma(BVTColorMapper self);
BVT_API RetVal BVTColorMapper_SetAutoMode(BVTColorMapper self, int on);
BVT_API int BVTColorMapper_GetAutoMode(BVTColorMapper self);

/* RangeData: one range per bearing, left to right; metres and degrees clockwise from ahead. A range above 999 means no echo above
 * the threshold. The threshold is 10000 of 65535 unless BVTHead_SetRangeDataThreshold sets another. */
BVT_API int BVTRangeData_GetCount(BVTRangeData self);
BVT_API float BVTRangeData_GetRangeValue(BVTRangeData self, int i);
BVT_API float BVTRangeData_GetBearingValue(BVTRangeData self, int i);
BVT_API unsigned short BVTRangeData_GetIntensityValue(BVTRangeData self, int i);
BVT_API float BVTRangeData_GetFOVMinAngle(BVTRangeData self);
BVT_API float BVTRangeData_GetFOVMaxAngle(BVTRangeData self);
BVT_API double BVTRangeData_GetRangeResolution(BVTRangeData self);
BVT_API double BVTRangeData_GetBearingResolution(BVTRangeData self);
BVT_API RetVal BVTRangeData_CopyRangeValues(BVTRangeData self, float* buffer, int count);

/* NavData: position and attitude of the vehicle. The getter of a value that was not set returns BVT_NAV_NO_DATA. */
BVT_API BVTNavData BVTNavData_Create(void);
BVT_API void BVTNavData_Destroy(BVTNavData self);
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
BVT_API int BVTSonarDiscoveryAgent_GetSonarCount(BVTSonarDiscoveryAgent self);
BVT_API RetVal BVTSonarDiscoveryAgent_GetSonarInfo(BVTSonarDiscoveryAgent self, int i, char* buffer,
                                                   int buffer_size); /* its IPv4 address */

/* Errors, version, log. */
BVT_API const char* BVTError_GetString(RetVal code);
BVT_API const char* BVTError_GetName(RetVal code);
BVT_API int BVTSDK_MajorVersion(void);
BVT_API int BVTSDK_MinorVersion(void);
BVT_API int BVTSDK_BuildNumber(void);
BVT_API RetVal BVTLogger_SetLevel(int level);           /* -1 none, 0 critical, 1 warning, 2 status */
BVT_API RetVal BVTLogger_SetTarget(const char* target); /* "stdout", "stderr", "null", or a file */

#ifdef __cplusplus
}

#include "bvt_sdk_classes.h"
#endif
