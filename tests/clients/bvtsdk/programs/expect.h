/* Shared by the call-sequence programs: checks that end the program, and the targets of scenes/l-targets.yaml where they
 * must appear. Valid C99 and C++98, for both interfaces; BVT_ABI selects one. */
#pragma once

#include <bvt_sdk.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define EXPECT(condition)                                                      \
  do {                                                                         \
    if (!(condition)) {                                                        \
      fprintf(stderr, "%s:%d: expected %s\n", __FILE__, __LINE__, #condition); \
      exit(1);                                                                 \
    }                                                                          \
  } while (0)
#define EXPECT_CODE(call, wanted)                                                                            \
  do {                                                                                                       \
    const int code_ = (call);                                                                                \
    if (code_ != (wanted)) {                                                                                 \
      fprintf(stderr, "%s:%d: %s gave %d, %s\n", __FILE__, __LINE__, #call, code_, BVTError_GetName(code_)); \
      exit(1);                                                                                               \
    }                                                                                                        \
  } while (0)
#define EXPECT_OK(call) EXPECT_CODE(call, BVT_SUCCESS)
#define EXPECT_NEAR(value, wanted, by)                                                           \
  do {                                                                                           \
    const double value_ = (value), wanted_ = (wanted);                                           \
    if (!(fabs(value_ - wanted_) <= (by))) {                                                     \
      fprintf(stderr, "%s:%d: %s is %g, not %g\n", __FILE__, __LINE__, #value, value_, wanted_); \
      exit(1);                                                                                   \
    }                                                                                            \
  } while (0)

/* The nearest point of a sphere, m and degrees clockwise from ahead, and a sector that contains only this sphere. */
typedef struct {
  double range_m, bearing_deg, from_deg, to_deg;
} Target;
static const Target targets[3] = {{3.9, -20, -30, -14}, {3.9, 10, 2, 20}, {6.9, -8, -12, -4}};

/* The strongest sample found so far in the sector of a target. */
typedef struct {
  double strength, range_m, bearing_deg;
} Found;

static inline void look(Found found[3], double strength, double range_m, double bearing_deg) {
  int i;
  for (i = 0; i < 3; ++i) {
    if (bearing_deg < targets[i].from_deg || bearing_deg > targets[i].to_deg || range_m < 2 || range_m > 8.5) continue;
    if (strength <= found[i].strength) continue;
    found[i].strength = strength;
    found[i].range_m = range_m;
    found[i].bearing_deg = bearing_deg;
  }
}

static inline void expect_targets(const char* where, const Found found[3]) {
  int i;
  for (i = 0; i < 3; ++i) {
    printf("%s: %.2f m, %.1f deg, strength %.0f\n", where, found[i].range_m, found[i].bearing_deg, found[i].strength);
    EXPECT_NEAR(found[i].range_m, targets[i].range_m, 0.15);
    EXPECT_NEAR(found[i].bearing_deg, targets[i].bearing_deg, 1.2);
  }
}

static inline void expect_targets_in_image(const char* where, BVTMagImage image) {
  Found found[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  int row, col;
#if BVT_ABI == 3
  const int height = BVTMagImage_GetHeight(image), width = BVTMagImage_GetWidth(image);
  const unsigned short* bits = BVTMagImage_GetBits(image);
#else
  int height, width;
  unsigned short* bits;
  EXPECT_OK(BVTMagImage_GetHeight(image, &height));
  EXPECT_OK(BVTMagImage_GetWidth(image, &width));
  EXPECT_OK(BVTMagImage_GetBits(image, &bits));
#endif
  EXPECT(height > 0 && width > 0 && bits);
  EXPECT(height * width <= 1000000); /* drivers keep four bytes per pixel on their stack */
  for (row = 0; row < height; ++row)
    for (col = 0; col < width; ++col) {
      const double strength = bits[(size_t)row * (size_t)width + (size_t)col];
#if BVT_ABI == 3
      look(found, strength, BVTMagImage_GetPixelRange(image, row, col), BVTMagImage_GetPixelRelativeBearing(image, row, col));
#else
      double range_m, bearing_deg;
      if (strength < 2000) continue; /* avoids two calls for most pixels */
      EXPECT_OK(BVTMagImage_GetPixelRange(image, row, col, &range_m));
      EXPECT_OK(BVTMagImage_GetPixelRelativeBearing(image, row, col, &bearing_deg));
      look(found, strength, range_m, bearing_deg);
#endif
    }
  expect_targets(where, found);
}
