// IPv4 addresses: conversion from text to bytes to number and back. All other texts are refused.
#include "core/text/ipv4.hpp"

#include <gtest/gtest.h>

namespace sonar::text {
namespace {

TEST(Ipv4, TextBytesAndNumberAgree) {
  const Ipv4 ip{192, 168, 1, 2};
  EXPECT_EQ(parse_ipv4("192.168.1.2"), ip);
  EXPECT_EQ(format_ipv4(ip), "192.168.1.2");
  EXPECT_EQ(number_from_ipv4(ip), 0xC0A80102u);
  EXPECT_EQ(ipv4_from_number(0xC0A80102u), ip);
  EXPECT_EQ(parse_ipv4("255.255.255.255"), (Ipv4{255, 255, 255, 255}));
}

TEST(Ipv4, OtherTextIsRefused) {
  for (const char* wrong : {"", "1.2.3", "1.2.3.4.5", "1.2.3.4 ", "a.b.c.d", "1.2.3.-4", "01.2.3.4", "1.2.3.256", "1..3.4",
                            "+1.2.3.4", "1.2.3.4x", "1.2.3.99999999999999999999"})
    EXPECT_FALSE(parse_ipv4(wrong)) << wrong;
}

}  // namespace
}  // namespace sonar::text
