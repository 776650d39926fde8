// Tests reading and writing payloads of PING_DATA.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "tests/clients/bvtsdk/made_ping.hpp"

namespace sonar::bvt {
namespace {

constexpr Packing every_packing[] = {Packing::plain, Packing::deflate, Packing::planes};

PolarPing some_ping() {
  PolarPing p = make_ping(5, 7, 1.5f, 0.25f, [](int j, int k) { return 256 * j + k; });
  p.head = 1;
  p.time_zone_s = -3600;
  p.sound_speed_mps = 1480;
  p.nav.present = nav_time | nav_depth | nav_heading | nav_text;
  p.nav.time_s = 123.5;
  p.nav.depth_m = 12.5f;
  p.nav.heading_deg = 271;
  p.nav.text = "north quay";
  return p;
}

void expect_same(const PolarPing& a, const PolarPing& b) {
  EXPECT_EQ(a.head, b.head);
  EXPECT_EQ(a.number, b.number);
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.time_zone_s, b.time_zone_s);
  EXPECT_EQ(a.start_m, b.start_m);
  EXPECT_EQ(a.stop_m, b.stop_m);
  EXPECT_EQ(a.sound_speed_mps, b.sound_speed_mps);
  EXPECT_EQ(a.fov_min_deg, b.fov_min_deg);
  EXPECT_EQ(a.fov_max_deg, b.fov_max_deg);
  EXPECT_EQ(a.bin_m, b.bin_m);
  EXPECT_EQ(a.beams, b.beams);
  EXPECT_EQ(a.bins, b.bins);
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.nav.present, b.nav.present);
  EXPECT_EQ(a.nav.time_s, b.nav.time_s);
  EXPECT_EQ(a.nav.depth_m, b.nav.depth_m);
  EXPECT_EQ(a.nav.heading_deg, b.nav.heading_deg);
  EXPECT_EQ(a.nav.text, b.nav.text);
}

TEST(PolarPing, IsReadBackUnchanged) {
  for (const Packing packing : every_packing) {
    const auto back = decode_ping(encode_ping(some_ping(), packing));
    ASSERT_TRUE(back) << static_cast<int>(packing);
    expect_same(*back, some_ping());
  }
}

TEST(PolarPing, ReadsTheBytesOfTheDescription) {
  // Written by hand from docs/protocols/blueview-link.md: 2 beams of 3 bins, heading only.
  const Bytes payload{2,    0,    0,    0,                                         // head
                      9,    0,    0,    0,                                         // number
                      0,    0,    0,    0,    0, 0, 0xF0, 0x3F,                    // 1 s
                      0x10, 0x0E, 0,    0,                                         // + 3600 s
                      0,    0,    0,    0x3F, 0, 0, 0,    0x40,                    // 0.5 m to 2 m
                      0xDC, 0x05, 0,    0,                                         // 1500 m/s
                      0,    0,    0,    0xC0, 0, 0, 0,    0x40,                    // -2 to 2 degrees
                      0,    0,    0,    0x3F, 2, 0, 3,    0,    1, 0, 0x80, 0x00,  // 0.5 m, 2 x 3, u16, plain, heading
                      0,    0,    0x34, 0x42,                                      // 45 degrees
                      12,   0,    0,    0,    1, 0, 2,    0,    3, 0, 4,    1,    5, 0, 0xFF, 0xFF};
  std::string why;
  const auto p = decode_ping(payload, &why);
  ASSERT_TRUE(p) << why;
  EXPECT_EQ(p->head, 2);
  EXPECT_EQ(p->number, 9u);
  EXPECT_EQ(p->time_s, 1);
  EXPECT_EQ(p->time_zone_s, 3600);
  EXPECT_EQ(p->stop_m, 2);
  EXPECT_EQ(p->sound_speed_mps, 1500);
  EXPECT_EQ(p->nav.present, nav_heading);
  EXPECT_EQ(p->nav.heading_deg, 45);
  EXPECT_EQ(p->samples, (std::vector<std::uint16_t>{1, 2, 3, 260, 5, 65535}));
  EXPECT_DOUBLE_EQ(p->bearing_deg(1), 1);
  EXPECT_DOUBLE_EQ(p->range_m(2), 1.75);
}

TEST(PolarPing, IsRefusedWhenCutAnywhere) {
  for (const Packing packing : every_packing) {
    const Bytes whole = encode_ping(some_ping(), packing);
    for (std::size_t n = 0; n < whole.size(); ++n) {
      const auto exact = std::make_unique<std::uint8_t[]>(n);  // so that a sanitizer detects a read beyond it
      std::copy_n(whole.begin(), n, exact.get());
      std::string why;
      EXPECT_FALSE(decode_ping({exact.get(), n}, &why)) << n;
      EXPECT_FALSE(why.empty());
    }
    Bytes longer = whole;
    longer.push_back(0);
    EXPECT_FALSE(decode_ping(longer));
  }
}

TEST(PolarPing, IsRefusedWithInvalidFields) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::function<void(PolarPing&)>> harms{
      [&](PolarPing& p) { p.start_m = nan; },
      [&](PolarPing& p) { p.start_m = -1; },
      [&](PolarPing& p) { p.stop_m = p.start_m; },
      [&](PolarPing& p) { p.bin_m = 0; },
      [&](PolarPing& p) { p.bin_m = nan; },
      [&](PolarPing& p) { p.sound_speed_mps = 0; },
      [&](PolarPing& p) { p.fov_max_deg = p.fov_min_deg; },
      [&](PolarPing& p) { p.fov_min_deg = -181; },
      [&](PolarPing& p) { p.time_s = std::numeric_limits<double>::infinity(); },
      [&](PolarPing& p) { p.beams = 6; },
      [&](PolarPing& p) { p.samples.pop_back(); }};
  for (std::size_t i = 0; i < harms.size(); ++i) {
    PolarPing p = some_ping();
    harms[i](p);
    EXPECT_FALSE(decode_ping(encode_ping(p))) << i;
  }
}

TEST(PolarPing, IsNotInflatedBeyondTheStatedSize) {
  // Two bad streams: one announces 70 bytes and has 2 MB of zeros; the other announces 60 MB and has 20 bytes.
  const Bytes small = encode_ping(some_ping(), Packing::deflate);
  const PolarPing zeros = make_ping(512, 2048, 1, 0.01f, [](int, int) { return 0; });
  const Bytes big = encode_ping(zeros, Packing::deflate);
  ASSERT_LT(big.size(), 20000u);
  const std::size_t small_fixed = encode_ping(some_ping()).size() - 70;
  Bytes mixed(small.begin(), small.begin() + static_cast<std::ptrdiff_t>(small_fixed));
  const std::size_t big_fixed = encode_ping(zeros).size() - 2 * zeros.samples.size();
  mixed.insert(mixed.end(), big.begin() + static_cast<std::ptrdiff_t>(big_fixed), big.end());
  EXPECT_FALSE(decode_ping(mixed));
  PolarPing hungry = zeros;
  hungry.beams = 8000;
  hungry.bins = 4000;
  Bytes bomb = encode_ping(hungry, Packing::deflate);
  const std::uint32_t size = 2u * 8000 * 4000;
  for (std::size_t i = 0; i < 4; ++i) bomb[big_fixed - 4 + i] = static_cast<std::uint8_t>(size >> (8 * i));
  EXPECT_FALSE(decode_ping(bomb));
}

TEST(PolarPing, IsSmallerInPlanesThanInOneStream) {
  std::uint32_t state = 1;
  const PolarPing noise = make_ping(256, 500, 1, 0.02f, [&](int, int) {
    state = state * 1664525u + 1013904223u;
    return static_cast<int>(state >> 24) * static_cast<int>(state >> 24) / 512;  // like noise: mostly far below 256
  });
  const std::size_t plain = encode_ping(noise).size(), stream = encode_ping(noise, Packing::deflate).size();
  const std::size_t planes = encode_ping(noise, Packing::planes).size();
  EXPECT_LT(planes, 0.55 * static_cast<double>(plain));
  EXPECT_LT(planes, 0.95 * static_cast<double>(stream));
}

TEST(PolarPing, MayHaveNoSamples) {
  const auto p = decode_ping(encode_ping(make_ping(0, 0, 0, 0.1f, [](int, int) { return 0; })));
  EXPECT_FALSE(p);  // stop = start
  PolarPing empty = make_ping(4, 0, 0, 0.1f, [](int, int) { return 0; });
  empty.stop_m = 10;
  const auto q = decode_ping(encode_ping(empty, Packing::planes));
  ASSERT_TRUE(q);
  EXPECT_FALSE(q->has_signal());
}

TEST(NavData, OmitsNonFiniteNumbersAndRefusesUnknownFields) {
  NavData nav;
  nav.present = nav_latitude | nav_roll;
  nav.latitude_deg = std::nan("");
  nav.roll_deg = 3;
  Bytes bytes;
  put_nav(bytes, nav);
  Reader reader(bytes);
  const NavData back = decode_nav(reader);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(back.present, nav_roll);
  EXPECT_EQ(back.roll_deg, 3);
  const Bytes strange{0x00, 0x80, 0, 0, 0, 0};
  Reader other(strange);
  EXPECT_EQ(decode_nav(other).present, 0);
  EXPECT_FALSE(other.ok());
}

}  // namespace
}  // namespace sonar::bvt
