/* 4.x, C: one thread pings, another stores and destroys the pings while the next is fetched; navigation, event marks, clocks
 * compared, as a vehicle's control system does.
 * usage: c4_logger_thread ADDRESS RECORDING */
#include <pthread.h>
#include <string.h>
#include <time.h>

#include "tests/clients/bvtsdk/programs/expect.h"

enum { pings = 12 };
static BVTHead log_head;
static BVTPing queue[pings];
static int queued;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t more = PTHREAD_COND_INITIALIZER;

static void* store(void* nothing) {
  int i;
  for (i = 0; i < pings; ++i) {
    pthread_mutex_lock(&mutex);
    while (queued <= i) pthread_cond_wait(&more, &mutex);
    pthread_mutex_unlock(&mutex);
    EXPECT_OK(BVTHead_PutPing(log_head, queue[i]));
    BVTPing_Destroy(queue[i]);
  }
  return nothing;
}

static void hand_over(BVTPing ping) {
  pthread_mutex_lock(&mutex);
  queue[queued++] = ping;
  pthread_cond_signal(&more);
  pthread_mutex_unlock(&mutex);
}

static void add_navigation(BVTPing ping, int i) {
  BVTNavData nav = BVTNavData_Create();
  double latitude = 7;
  EXPECT(nav);
  EXPECT_CODE(BVTNavData_GetLatitude(nav, &latitude), BVT_NAV_NO_DATA);
  EXPECT(latitude == 0);
  EXPECT_OK(BVTNavData_SetNavTime(nav, 1000.5 + i));
  EXPECT_OK(BVTNavData_SetLatitude(nav, 41.185));
  EXPECT_OK(BVTNavData_SetLongitude(nav, -8.705));
  EXPECT_OK(BVTNavData_SetDepth(nav, 3));
  EXPECT_OK(BVTNavData_SetAltitude(nav, 2));
  EXPECT_OK(BVTNavData_SetPitchAngle(nav, 1));
  EXPECT_OK(BVTNavData_SetRollAngle(nav, -1));
  EXPECT_OK(BVTNavData_SetHeading(nav, 90));
  EXPECT_OK(BVTNavData_SetHeadingVelocity(nav, 1.5f));
  EXPECT_OK(BVTNavData_SetCourseOverGround(nav, 91));
  EXPECT_OK(BVTNavData_SetUserNavString(nav, "survey 1"));
  EXPECT_OK(BVTPing_SetNavData(ping, nav));
  BVTNavData_Destroy(nav); /* the ping has a copy */
}

static void check_playback(BVTSonar player, const char* file_name) {
  BVTHead head;
  BVTPing ping = NULL;
  BVTNavData nav = (BVTNavData)&head; /* is overwritten, never looked at */
  char text[100];
  int number = 0, last = -1, i;
  double latitude = 0;
  EXPECT_OK(BVTSonar_Open(player, "FILE", file_name));
  EXPECT_OK(BVTSonar_GetHead(player, 0, &head));
  for (i = 0; i < pings; ++i) {
    EXPECT_OK(BVTHead_GetPing(head, i, &ping));
    EXPECT_OK(BVTPing_GetPingNumber(ping, &number));
    EXPECT(number > last);
    last = number;
    if (i < pings - 1) BVTPing_Destroy(ping);
  }
  EXPECT_OK(BVTPing_GetNavDataCopy(ping, &nav));
  BVTPing_Destroy(ping);
  EXPECT_OK(BVTNavData_GetLatitude(nav, &latitude));
  EXPECT_NEAR(latitude, 41.185, 1e-12);
  EXPECT_CODE(BVTNavData_GetUserNavString(nav, text, 5), BVT_BUFFER_TOO_SMALL);
  EXPECT(text[0] == 0);
  EXPECT_OK(BVTNavData_GetUserNavString(nav, text, sizeof text));
  EXPECT(strcmp(text, "survey 1") == 0);
  BVTNavData_Destroy(nav);
  EXPECT_CODE(BVTHead_GetPing(head, pings, &ping), BVT_PING_NUM_TOO_LARGE);
  EXPECT(ping == NULL);
  BVTHead_Destroy(head);
}

int main(int count, char** arguments) {
  BVTSonar sonar = BVTSonar_Create(), log = BVTSonar_Create();
  BVTHead head;
  pthread_t logger;
  int i, code = -1;
  char too_long[90];
  EXPECT(count == 3);
  BVTSDK_Init();
  EXPECT_OK(BVTSonar_Open(sonar, "NET", arguments[1]));
  EXPECT_OK(BVTSonar_SetTimestampsUseLocalClock(sonar, 0));
  EXPECT_OK(BVTSonar_GetTimestampsUseLocalClock(sonar, &code));
  EXPECT(code == 0);
  EXPECT_OK(BVTSonar_GetHead(sonar, 0, &head));
  EXPECT_OK(BVTHead_SetRange(head, 1, 9));
  EXPECT_OK(BVTHead_SetMountType(head, BVT_MOUNTTYPE_UUV));
  EXPECT_OK(BVTSonar_CreateFile(log, arguments[2], sonar, ""));
  EXPECT_OK(BVTSonar_GetHead(log, 0, &log_head));
  memset(too_long, 'x', 81);
  too_long[81] = 0;
  EXPECT_OK(BVTSonar_PutEventMark(log, "start", "the survey begins"));
  EXPECT_CODE(BVTSonar_PutEventMark(log, too_long, ""), BVT_BAD_PARAMETER);
  EXPECT_CODE(BVTSonar_PutEventMark(sonar, "start", ""), BVT_READONLY_FILE);
  EXPECT(pthread_create(&logger, NULL, store, NULL) == 0);
  for (i = 0; i < pings; ++i) {
    BVTPing ping;
    double stamp = 0;
    EXPECT_OK(BVTHead_GetPing(head, -1, &ping));
    EXPECT_OK(BVTPing_GetTimestamp(ping, &stamp));
    EXPECT(fabs(stamp - (double)time(NULL)) <= 2 + 1); /* time() has whole seconds */
    add_navigation(ping, i);
    hand_over(ping);
  }
  EXPECT(pthread_join(logger, NULL) == 0);
  BVTSonar_Destroy(sonar); /* before its head */
  {
    BVTPing ping = (BVTPing)&i;
    EXPECT_CODE(BVTHead_GetPing(head, -1, &ping), BVT_SOCKET_CLOSED);
    EXPECT(ping == NULL);
  }
  BVTHead_Destroy(head);
  check_playback(log, arguments[2]); /* the same object, opened again */
  BVTHead_Destroy(log_head);
  BVTSonar_Destroy(log);
  BVTSDK_Shutdown();
  return 0;
}
