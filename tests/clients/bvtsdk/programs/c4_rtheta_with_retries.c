/* 4.x, C: tries to connect until the sonar answers, and destroys objects that were never made. Then it makes R-Theta images, with
 * the far end in row 0.
 * usage: c4_rtheta_with_retries ADDRESS UNUSED_ADDRESS */
#include "tests/clients/bvtsdk/programs/expect.h"

static BVTSonar sonar;
static BVTHead head;
static BVTImageGenerator generator;

static void disconnect(void) {
  BVTImageGenerator_Destroy(generator);
  BVTHead_Destroy(head);
  BVTSonar_Destroy(sonar);
  generator = NULL;
  head = NULL;
  sonar = NULL;
}

static int connect_to(const char* address) {
  int code;
  sonar = BVTSonar_Create();
  EXPECT(sonar);
  code = BVTSonar_Open(sonar, "NET", address);
  if (code != BVT_SUCCESS) {
    int connected = 7;
    head = (BVTHead)&code; /* whatever was there */
    EXPECT(BVTSonar_GetHead(sonar, 0, &head) != BVT_SUCCESS && head == NULL);
    EXPECT_OK(BVTSonar_IsConnected(sonar, &connected));
    EXPECT(connected == 0);
    disconnect();
    return code;
  }
  EXPECT_OK(BVTSonar_GetHead(sonar, 0, &head));
  EXPECT_OK(BVTHead_SetRange(head, 1, 9));
  EXPECT_OK(BVTHead_SetSoundSpeed(head, 1490));
  generator = BVTImageGenerator_Create();
  EXPECT(generator);
  return code;
}

/* Row 0 is the far end: ranges fall from row to row, bearings rise from column to column. */
static void check_order(BVTMagImage image) {
  int height, width;
  double resolution, bearing_resolution, far_m, near_m, left, right;
  float fov_min, fov_max;
  EXPECT_OK(BVTMagImage_GetHeight(image, &height));
  EXPECT_OK(BVTMagImage_GetWidth(image, &width));
  EXPECT_OK(BVTMagImage_GetRangeResolution(image, &resolution));
  EXPECT_OK(BVTMagImage_GetBearingResolution(image, &bearing_resolution));
  EXPECT_OK(BVTMagImage_GetFOVMinAngle(image, &fov_min));
  EXPECT_OK(BVTMagImage_GetFOVMaxAngle(image, &fov_max));
  EXPECT_OK(BVTMagImage_GetPixelRange(image, 0, 0, &far_m));
  EXPECT_OK(BVTMagImage_GetPixelRange(image, height - 1, 0, &near_m));
  EXPECT_OK(BVTMagImage_GetPixelRelativeBearing(image, 0, 0, &left));
  EXPECT_OK(BVTMagImage_GetPixelRelativeBearing(image, 0, width - 1, &right));
  EXPECT_NEAR(far_m, 9, 0.06);
  EXPECT_NEAR(near_m, 1, 0.06);
  EXPECT_NEAR(height * resolution, 8, 0.06);
  EXPECT_NEAR(fov_min, -45, 0.1);
  EXPECT_NEAR(fov_max, 45, 0.1);
  EXPECT_NEAR(left, fov_min, 0.2);
  EXPECT_NEAR(right, fov_max, 0.4);
  EXPECT_NEAR(width * bearing_resolution, 90, 0.1);
}

int main(int count, char** arguments) {
  int tries, interval = -1;
  EXPECT(count == 3);
  disconnect(); /* before anything was made */
  for (tries = 0; tries < 3; ++tries) {
    const int code = connect_to(arguments[tries < 2 ? 2 : 1]);
    if (code == BVT_SUCCESS) break;
    EXPECT_CODE(code, BVT_CONNECTION_TIMEDOUT);
  }
  EXPECT(tries == 2);
  EXPECT_OK(BVTHead_GetPingInterval(head, &interval));
  EXPECT(interval == 0);
  {
    BVTPing ping = NULL;
    BVTMagImage image = (BVTMagImage)&interval;
    EXPECT_OK(BVTHead_GetPing(head, -1, &ping));
    EXPECT_CODE(BVTImageGenerator_GetImageRTheta(generator, ping, &image), BVT_BAD_HEAD);
    EXPECT(image == NULL);
    EXPECT_OK(BVTImageGenerator_SetHead(generator, head));
    EXPECT_OK(BVTImageGenerator_GetImageRTheta(generator, ping, &image));
    check_order(image);
    expect_targets_in_image("R-Theta", image);
    BVTPing_Destroy(ping);
    EXPECT_CODE(BVTImageGenerator_GetImageRTheta(generator, ping, &image), BVT_INVALID_PTR);
    EXPECT(image == NULL);
  }
  disconnect();
  disconnect();
  return 0;
}
