// A C++98 program for 3.x, with C calls and the class RangeData. It finds, pings and records a sonar, then plays the file.
// usage: c3_discovery_then_file ADDRESS COLORMAPS RECORDING
#include <string.h>
#include <unistd.h>

#include <string>

#include "tests/clients/bvtsdk/programs/expect.h"

static void discover(const char* address) {
  BVTSonarDiscoveryAgent agent = BVTSonarDiscoveryAgent_Create();
  bool found = false;
  char text[20];
  EXPECT(agent != NULL);
  EXPECT_OK(BVTSonarDiscoveryAgent_Start(agent));
  for (int tries = 0; tries < 100 && !found; ++tries) {
    usleep(100000);
    for (int i = 0; i < BVTSonarDiscoveryAgent_GetSonarCount(agent); ++i) {
      EXPECT_OK(BVTSonarDiscoveryAgent_GetSonarInfo(agent, i, text, sizeof text));
      if (strcmp(text, address) == 0) found = true;
    }
  }
  EXPECT_OK(BVTSonarDiscoveryAgent_Stop(agent));
  EXPECT(BVTSonarDiscoveryAgent_GetSonarCount(agent) > 0);
  EXPECT_CODE(BVTSonarDiscoveryAgent_GetSonarInfo(agent, 1000, text, sizeof text), BVT_INDEX_OUTOFBOUNDS);
  BVTSonarDiscoveryAgent_Destroy(agent);
  EXPECT(found);
}

static BVTHead first_head(BVTSonar sonar) {
  BVTHead head = NULL;
  if (BVTSonar_GetHead(sonar, 0, &head) != BVT_SUCCESS) EXPECT_OK(BVTSonar_GetHead(sonar, 1, &head));
  EXPECT(head != NULL);
  return head;
}

static void configure(BVTHead head) {
  BVTHead_SetRange(head, 0, 9);  // below the minimum range: raised to it
  BVTHead_SetRange(head, 1, 9);
  EXPECT_OK(BVTHead_SetSoundSpeed(head, 1490));
  EXPECT_OK(BVTHead_SetImageRes(head, BVTHEAD_RES_AUTO));
  EXPECT_OK(BVTHead_SetImageType(head, BVTHEAD_IMAGE_XY));
  EXPECT_OK(BVTHead_SetRangeDataThreshold(head, 10000));
}

static void check_range_data(BVTPing ping) {
  BVTSDK::RangeData data, again;
  EXPECT_OK(BVTPing_GetRangeData(ping, data));
  EXPECT_OK(BVTPing_GetRangeData(ping, again));
  EXPECT(data.GetCount() == 512 && data.Handle() == again.Handle());
  EXPECT_NEAR(data.GetFOVMinAngle(), -45, 0.1);
  EXPECT_NEAR(data.GetBearingResolution(), 90.0 / 512, 1e-3);
  float ranges[512];
  EXPECT_OK(BVTRangeData_CopyRangeValues(data, ranges, 512));
  EXPECT_CODE(BVTRangeData_CopyRangeValues(data, ranges, 511), BVT_BUFFER_TOO_SMALL);
  Found found[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  int none = 0;
  for (int i = 0; i < data.GetCount(); ++i) {
    EXPECT(ranges[i] == data.GetRangeValue(i));
    if (ranges[i] > 999)
      ++none;
    else
      look(found, data.GetIntensityValue(i), ranges[i], data.GetBearingValue(i));
  }
  EXPECT(none > 100);
  expect_targets("range data", found);
}

static void check_image(BVTPing ping, const std::string& colour_maps, const std::string& picture) {
  BVTMagImage image = NULL;
  EXPECT_OK(BVTPing_GetImage(ping, &image));
  expect_targets_in_image("XY", image);
  BVTSDK::RangeData ranges;  // hosts turn ranges into rows with the range data's resolution
  EXPECT_OK(BVTPing_GetRangeData(ping, ranges));
  EXPECT_NEAR(ranges.GetRangeResolution(), BVTMagImage_GetRangeResolution(image), 1e-9);
  const int height = BVTMagImage_GetHeight(image), width = BVTMagImage_GetWidth(image);
  // The image begins where the sector does, 1 m cos 45 degrees ahead of the sonar.
  EXPECT_NEAR((BVTMagImage_GetOriginRow(image) - height) * BVTMagImage_GetRangeResolution(image), 0.707,
              BVTMagImage_GetRangeResolution(image));
  EXPECT(BVTMagImage_GetOriginCol(image) == width / 2);
  const double beyond = BVTMagImage_GetPixelRange(image, height, width);  // one past the end
  EXPECT(beyond == beyond);
  EXPECT(BVTMagImage_GetRow(image, 1) == BVTMagImage_GetBits(image) + width && BVTMagImage_GetRow(image, height) == NULL);
  EXPECT(BVTMagImage_GetPixel(image, 0, -1) == 0);
  BVTColorMapper mapper = BVTColorMapper_Create();
  BVTColorImage colours = NULL;
  EXPECT_OK(BVTColorMapper_Load(mapper, (colour_maps + "/jet.cmap").c_str()));
  EXPECT_OK(BVTColorMapper_MapImage(mapper, image, &colours));
  EXPECT(BVTColorImage_GetHeight(colours) == height && BVTColorImage_GetBits(colours) != NULL);
  EXPECT_OK(BVTColorImage_SavePPM(colours, picture.c_str()));
  BVTColorImage_Destroy(colours);
  BVTColorMapper_Destroy(mapper);
  BVTMagImage_Destroy(image);
}

int main(int count, char** arguments) {
  EXPECT(count == 4);
  const std::string recording = arguments[3];
  discover(arguments[1]);
  BVTSonar sonar = BVTSonar_Create();
  EXPECT_OK(BVTSonar_Open(sonar, "NET", arguments[1]));
  EXPECT(BVTSonar_GetHeadCount(sonar) == 1);
  BVTHead head = first_head(sonar);
  EXPECT(head == first_head(sonar));  // the same head for each call
  configure(head);
  BVTSonar file = BVTSonar_Create();
  EXPECT_OK(BVTSonar_CreateFile(file, recording.c_str(), sonar, ""));
  for (int i = 0; i < 2; ++i) {
    BVTPing ping = NULL;
    EXPECT_OK(BVTHead_GetPing(head, i, &ping));
    EXPECT_OK(BVTHead_PutPing(first_head(file), ping));
    if (i == 0) check_range_data(ping);
    if (i == 0) check_image(ping, arguments[2], recording + ".ppm");
    BVTSDK::RangeData data;
    EXPECT_OK(BVTPing_GetRangeData(ping, data));
    BVTPing_Destroy(ping);
    EXPECT(data.GetCount() == 0);  // released with its ping
  }
  EXPECT(BVTSonar_GetFileSize(file) > 100);
  BVTSonar_Destroy(file);

  EXPECT_OK(BVTSonar_Open(sonar, "FILE", recording.c_str()));  // again, on the same object
  EXPECT_CODE(BVTHead_SetRange(head, 1, 9), BVT_INVALID_PTR);  // the old head became invalid with its sonar
  head = first_head(sonar);
  configure(head);
  EXPECT(BVTHead_GetPingCount(head) == 2);
  for (int i = 0; i < BVTHead_GetPingCount(head); ++i) {
    BVTPing ping = NULL;
    EXPECT_OK(BVTHead_GetPing(head, i, &ping));
    check_range_data(ping);
    check_image(ping, arguments[2], recording + ".ppm");
    BVTPing_Destroy(ping);
  }
  EXPECT_CODE(BVTSonar_Open(sonar, "FILE", (recording + ".ppm").c_str()), BVT_FILE_HEADER_BAD);  // like a vendor's .son file
  EXPECT_CODE(BVTSonar_Open(sonar, "FILE", (recording + ".lost").c_str()), BVT_FILE_OPEN);
  EXPECT(BVTHead_GetPingCount(head) == 2);  // the open file stays open: hosts search for the next part of a recording in this way
  BVTSonar_Destroy(sonar);
  EXPECT_CODE(BVTHead_SetRange(head, 1, 9), BVT_INVALID_PTR);
  return 0;
}
