/* 4.x, C: two threads ping one head, a third reads and changes its settings, a fourth makes images of one ping; then the sonar is
 * destroyed under a thread that waits for a ping.
 * usage: c4_shared_between_threads ADDRESS */
#include <pthread.h>
#include <time.h>

#include "tests/clients/bvtsdk/programs/expect.h"

static BVTHead head;
static BVTPing shared_ping;
static BVTImageGenerator generator;

static void* ping_often(void* nothing) {
  int i;
  for (i = 0; i < 6; ++i) {
    BVTPing ping = NULL;
    EXPECT_OK(BVTHead_GetPing(head, -1, &ping));
    BVTPing_Destroy(ping);
  }
  return nothing;
}

static void* change_settings(void* nothing) {
  int i;
  for (i = 0; i < 10; ++i) {
    float gain = 1;
    EXPECT_OK(BVTHead_SetGainAdjustment(head, -6));
    EXPECT_OK(BVTHead_GetGainAdjustment(head, &gain));
    EXPECT_NEAR(gain, -6, 1e-6);
  }
  return nothing;
}

static void* make_images(void* nothing) {
  int i;
  for (i = 0; i < 6; ++i) {
    BVTMagImage image = NULL;
    BVTRangeProfile profile = NULL;
    EXPECT_OK(BVTImageGenerator_GetImageXY(generator, shared_ping, &image));
    EXPECT_OK(BVTImageGenerator_GetRangeProfile(generator, shared_ping, &profile));
    BVTMagImage_Destroy(image);
    BVTRangeProfile_Destroy(profile);
  }
  return nothing;
}

static void* ping_until_lost(void* code) {
  BVTPing ping = NULL;
  while ((*(int*)code = BVTHead_GetPing(head, -1, &ping)) == BVT_SUCCESS) BVTPing_Destroy(ping);
  EXPECT(ping == NULL);
  return code;
}

int main(int count, char** arguments) {
  void* (*const work[5])(void*) = {ping_often, ping_often, change_settings, make_images, make_images};
  const struct timespec moment = {0, 300000000};
  pthread_t threads[5];
  BVTSonar sonar = BVTSonar_Create();
  int i, code = -1;
  EXPECT(count == 2);
  EXPECT_OK(BVTSonar_Open(sonar, "NET", arguments[1]));
  EXPECT_OK(BVTSonar_GetHead(sonar, 0, &head));
  EXPECT_OK(BVTHead_SetRange(head, 1, 5));
  EXPECT_OK(BVTHead_GetPing(head, -1, &shared_ping));
  generator = BVTImageGenerator_Create();
  EXPECT_OK(BVTImageGenerator_SetHead(generator, head));
  for (i = 0; i < 5; ++i) EXPECT(pthread_create(&threads[i], NULL, work[i], NULL) == 0);
  for (i = 0; i < 5; ++i) EXPECT(pthread_join(threads[i], NULL) == 0);

  EXPECT(pthread_create(&threads[0], NULL, ping_until_lost, &code) == 0);
  nanosleep(&moment, NULL);
  BVTSonar_Destroy(sonar);
  EXPECT(pthread_join(threads[0], NULL) == 0);
  EXPECT_CODE(code, BVT_SOCKET_CLOSED);
  BVTHead_Destroy(head);
  BVTPing_Destroy(shared_ping);
  BVTImageGenerator_Destroy(generator);
  return 0;
}
