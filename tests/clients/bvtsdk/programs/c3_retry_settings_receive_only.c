/* 3.x, C: tries again only after a time-out (1015), sets and prints all values, and receives without transmitting. Then it pings
 * at the sonar's rate, and requests pixels one past the end.
 * usage: c3_retry_settings_receive_only ADDRESS UNUSED_ADDRESS */
#include <string.h>

#include "tests/clients/bvtsdk/programs/expect.h"

static unsigned short strongest(BVTHead head) {
  BVTPing ping = NULL;
  BVTMagImage image = NULL;
  unsigned short most = 0;
  int i, n;
  EXPECT_OK(BVTHead_GetPing(head, 0, &ping));
  EXPECT_OK(BVTPing_GetImageRTheta(ping, &image));
  n = BVTMagImage_GetHeight(image) * BVTMagImage_GetWidth(image);
  for (i = 0; i < n; ++i)
    if (BVTMagImage_GetBits(image)[i] > most) most = BVTMagImage_GetBits(image)[i];
  BVTMagImage_Destroy(image);
  BVTPing_Destroy(ping);
  return most;
}

static BVTHead open_head(BVTSonar sonar, char** arguments) {
  BVTHead head = NULL;
  int code = BVT_CONNECTION_TIMEDOUT, tries;
  for (tries = 0; tries < 5 && code == BVT_CONNECTION_TIMEDOUT; ++tries)
    code = BVTSonar_Open(sonar, "NET", arguments[tries < 3 ? 2 : 1]); /* the same object, again and again */
  EXPECT_OK(code);
  EXPECT(tries == 4);
  EXPECT_CODE(BVTSonar_GetHead(sonar, 7, &head), BVT_NO_HEAD);
  EXPECT_OK(BVTSonar_GetHead(sonar, 1, &head)); /* some number from 1 */
  return head;
}

static void set_and_print(BVTHead head) {
  char name[20];
  EXPECT_OK(BVTHead_SetRange(head, 2, 8));
  EXPECT_OK(BVTHead_SetSoundSpeed(head, 1490));
  EXPECT_OK(BVTHead_SetGainAdjustment(head, -6));
  EXPECT_OK(BVTHead_SetTVGSlope(head, 0.5f));
  EXPECT_OK(BVTHead_SetFluidType(head, BVTHEAD_FLUID_FRESHWATER));
  EXPECT_OK(BVTHead_SetImageFilterFlags(head, 2));
  EXPECT_OK(BVTHead_SetMountType(head, 3));
  EXPECT_CODE(BVTHead_SetMountType(head, 9), BVT_BAD_PARAMETER);
  EXPECT_OK(BVTHead_GetHeadName(head, name, sizeof name));
  printf("%s: %g to %g of %g to %g m, %d m/s, %g dB, %g dB/m, fluid %d, %d Hz, filter %d\n", name,
         (double)BVTHead_GetStartRange(head), (double)BVTHead_GetStopRange(head), (double)BVTHead_GetMinimumRange(head),
         (double)BVTHead_GetMaximumRange(head), BVTHead_GetSoundSpeed(head), (double)BVTHead_GetGainAdjustment(head),
         (double)BVTHead_GetTVGSlope(head), BVTHead_GetFluidType(head), BVTHead_GetCenterFreq(head),
         BVTHead_GetImageFilterFlags(head));
  EXPECT_NEAR(BVTHead_GetStartRange(head), 2, 1e-3);
  EXPECT_NEAR(BVTHead_GetStopRange(head), 8, 0.05);
  EXPECT(BVTHead_GetSoundSpeed(head) == 1490);
  EXPECT_NEAR(BVTHead_GetGainAdjustment(head), -6, 1e-6);
  EXPECT_NEAR(BVTHead_GetTVGSlope(head), 0.5, 1e-6);
  EXPECT(BVTHead_GetFluidType(head) == BVTHEAD_FLUID_FRESHWATER);
  EXPECT(BVTHead_GetMountType(head) == 3 && BVTHead_GetImageProcessingMethod(head) == 1);
  EXPECT(BVTHead_GetPingCount(head) == 1);
  EXPECT_OK(BVTHead_SetTVGSlope(head, 0));
  EXPECT_OK(BVTHead_SetImageFilterFlags(head, 0));
}

static void check_requested_size(BVTHead head) {
  BVTPing ping = NULL;
  BVTMagImage image = NULL;
  EXPECT_OK(BVTHead_SetImageReqSize(head, 480, 640)); /* height first */
  EXPECT_OK(BVTHead_GetPing(head, 1, &ping));
  EXPECT_OK(BVTPing_GetImage(ping, &image));
  EXPECT(BVTMagImage_GetHeight(image) == 480); /* kept; the width follows */
  EXPECT(BVTMagImage_GetPixelRange(image, 480, BVTMagImage_GetWidth(image)) < 100);
  expect_targets_in_image("XY, 480 rows", image);
  BVTPing_Destroy(ping);
  EXPECT(BVTMagImage_GetHeight(image) == 480); /* images do not need their ping */
  BVTMagImage_Destroy(image);
}

int main(int count, char** arguments) {
  BVTSonar sonar = BVTSonar_Create();
  BVTHead head;
  char text[64];
  unsigned short loud, deaf;
  EXPECT(count == 3);
  EXPECT_CODE(BVTSonar_Open(sonar, "COMPOSITE", "x"), BVT_BAD_PARAMETER);
  head = open_head(sonar, arguments);
  EXPECT_OK(BVTSonar_GetSonarTypeAsString(sonar, text, sizeof text));
  EXPECT(strcmp(text, "BlueView P900-90") == 0);
  EXPECT_CODE(BVTSonar_GetSonarTypeAsString(sonar, text, 16), BVT_BUFFER_TOO_SMALL);
  EXPECT(text[0] == 0);
  set_and_print(head);
  EXPECT_OK(BVTHead_SetTxEnable(head, 0));
  deaf = strongest(head);
  EXPECT_OK(BVTHead_SetTxEnable(head, 1));
  loud = strongest(head);
  printf("transmitting %d, receiving only %d\n", loud, deaf);
  EXPECT(deaf > 0 && deaf < loud / 4);
  check_requested_size(head);
  BVTSonar_Destroy(sonar);
  BVTSonar_Destroy(sonar);
  return 0;
}
