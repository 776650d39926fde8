/* 4.x, C: in each cycle opens the sonar, gets a head and closes; pings in every 50th. Descriptors, threads and memory must not
 * grow. usage: c4_open_close_cycles ADDRESS CYCLES */
#include <dirent.h>
#include <poll.h>
#include <string.h>

#include "tests/clients/bvtsdk/programs/expect.h"

#if !defined(__has_feature)
#define __has_feature(name) 0 /* clang has it, and does not define the two macros of gcc */
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || __has_feature(address_sanitizer) || \
    __has_feature(thread_sanitizer)
enum { memory_is_kept_back = 1 }; /* sanitizers keep freed memory for a while, and records of it; leaks are found at the end */
#else
enum { memory_is_kept_back = 0 };
#endif

static int entries_of(const char* folder) {
  DIR* dir = opendir(folder);
  int n = 0;
  EXPECT(dir);
  while (readdir(dir)) ++n;
  closedir(dir);
  return n;
}

static long resident_kib(void) {
  char line[200];
  long kib = 0;
  FILE* f = fopen("/proc/self/status", "r");
  EXPECT(f);
  while (fgets(line, sizeof line, f))
    if (strncmp(line, "VmRSS:", 6) == 0) kib = atol(line + 6);
  fclose(f);
  return kib;
}

int main(int count, char** arguments) {
  int i, cycles, descriptors = 0, threads = 0;
  long kib = 0;
  EXPECT(count == 3);
  cycles = atoi(arguments[2]);
  for (i = 0; i < cycles; ++i) {
    BVTSonar sonar = BVTSonar_Create();
    BVTHead head = NULL;
    EXPECT_OK(BVTSonar_Open(sonar, "NET", arguments[1]));
    EXPECT_OK(BVTSonar_GetHead(sonar, 0, &head));
    if (i % 50 == 0) {
      BVTPing ping = NULL;
      EXPECT_OK(BVTHead_SetRange(head, 1, 3));
      EXPECT_OK(BVTHead_GetPing(head, -1, &ping));
      BVTPing_Destroy(ping);
    }
    BVTHead_Destroy(head);
    BVTSonar_Destroy(sonar);
    if (i == cycles / 5) { /* warm */
      descriptors = entries_of("/proc/self/fd");
      threads = entries_of("/proc/self/task");
      kib = resident_kib();
    }
  }
  printf("%d cycles: descriptors %d to %d, threads %d to %d, resident %ld to %ld KiB\n", cycles, descriptors,
         entries_of("/proc/self/fd"), threads, entries_of("/proc/self/task"), kib, resident_kib());
  EXPECT(entries_of("/proc/self/fd") == descriptors);
  /* A thread that has been joined is listed for a moment more: either count can be one too high. */
  for (i = 0; i < 100 && entries_of("/proc/self/task") > threads; ++i) poll(NULL, 0, 10);
  EXPECT(entries_of("/proc/self/task") <= threads);
  EXPECT(memory_is_kept_back || resident_kib() < kib + 4096);
  return 0;
}
