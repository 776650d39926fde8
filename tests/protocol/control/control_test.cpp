// Tests protobuf control messages: hand-assembled bytes, round trips, refusals, framing at every split.
#include "protocol/control/control.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace sonar::control {
namespace {

using testing::HasSubstr;

/// A small protobuf writer of this test, so that the decoder is not checked only against the writer of its own library.
struct Wire {
  Bytes out;
  void byte(unsigned v) { out.push_back(static_cast<std::byte>(v)); }
  Wire& varint(unsigned field, unsigned v) {
    byte(field << 3);
    while (v > 127) {
      byte((v & 127) | 128);
      v >>= 7;
    }
    byte(v);
    return *this;
  }
  Wire& fixed64(unsigned field, const void* v) {
    byte(field << 3 | 1);
    const auto* p = static_cast<const std::byte*>(v);
    out.insert(out.end(), p, p + 8);
    return *this;
  }
  Wire& real(unsigned field, double v) { return fixed64(field, &v); }
  Wire& sub(unsigned field, const Bytes& v) {
    byte(field << 3 | 2);
    byte(static_cast<unsigned>(v.size()));
    out.insert(out.end(), v.begin(), v.end());
    return *this;
  }
};
Bytes vec(double x, double y, double z) { return Wire{}.real(1, x).real(2, y).real(3, z).out; }
Bytes quat(double w, double x, double y, double z) { return Wire{}.real(1, w).real(2, x).real(3, y).real(4, z).out; }
Bytes text(const char* s) {
  Bytes b(std::strlen(s));
  std::memcpy(b.data(), s, b.size());
  return b;
}
Bytes pose_bytes(unsigned frame, const Bytes& position, const Bytes& orientation) {
  Wire w;
  w.sub(1, text("rov")).varint(2, 7);
  if (frame != 0) w.varint(4, frame);
  return w.sub(5, position).sub(6, orientation).out;
}
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Control, APoseWithoutAnIdIsDetectedByItsFields) {
  EXPECT_TRUE(is_unasked_pose(encode_request({0, PoseSample{}})));
  EXPECT_FALSE(is_unasked_pose(encode_request({1, PoseSample{}})));
  EXPECT_FALSE(is_unasked_pose(encode_request({300, PoseSample{}})));
  EXPECT_FALSE(is_unasked_pose(encode_request({0, GetStatus{}})));
  EXPECT_FALSE(is_unasked_pose({}));
  EXPECT_TRUE(is_unasked_pose(Wire{}.sub(13, {}).out)) << "the pose of an object";
  EXPECT_FALSE(is_unasked_pose(Wire{}.sub(12, {}).sub(3, {}).out)) << "the last of two operations is used";
  EXPECT_FALSE(is_unasked_pose(Wire{}.sub(12, {}).varint(1, 7).out)) << "the id may come last";
  const Bytes whole = encode_request({0, PoseSample{}});
  for (std::size_t n = 0; n < whole.size(); ++n) EXPECT_FALSE(is_unasked_pose(BytesView(whole).first(n))) << n;
}

TEST(Control, DecodesHandAssembledNedPose) {
  const double h = std::sqrt(0.5);  // a yaw of 90 degrees, which is heading east
  const auto s = decode_pose_datagram(pose_bytes(1, vec(10, 20, 3), quat(h, 0, 0, h)));
  ASSERT_TRUE(s) << s.error().text;
  EXPECT_EQ(s->name, "rov");
  EXPECT_EQ(s->seq, 7u);
  EXPECT_EQ(s->stamp.domain, ClockDomain::arrival);
  EXPECT_EQ(s->pose.position_m.x, 20);
  EXPECT_EQ(s->pose.position_m.y, 10);
  EXPECT_EQ(s->pose.position_m.z, -3);
  EXPECT_NEAR(deg_from_rad(heading_rad(s->pose.orientation)), 90, 1e-9);
}

TEST(Control, DecodesHandAssembledEnuPoseWithTimeAndTwist) {
  const std::int64_t ns = 1234567890123456789;
  Wire w;
  w.sub(3, Wire{}.varint(1, 2).fixed64(2, &ns).out).varint(4, 2).sub(5, vec(1, 2, -3)).sub(6, quat(1, 0, 0, 0));
  w.sub(7, Wire{}.sub(1, vec(0.5, 0, 0)).sub(2, vec(0, 0, 0.1)).out).varint(8, 3);
  const auto s = decode_pose_datagram(w.out);
  ASSERT_TRUE(s) << s.error().text;
  EXPECT_EQ(s->stamp.domain, ClockDomain::sim);
  EXPECT_EQ(s->stamp.ns, ns);
  EXPECT_EQ(s->pose.position_m.y, 2);
  EXPECT_EQ(s->velocity_mps->x, 0.5);
  EXPECT_EQ(s->angular_velocity_radps->z, 0.1);
  EXPECT_EQ(s->reset_counter, 3u);
  EXPECT_EQ(s->fields, "time position orientation velocity angular_velocity");
}

TEST(Control, RefusalsHaveAReason) {
  const auto why = [](const Bytes& b) {
    const auto s = decode_pose_datagram(b);
    return s ? std::string("accepted") : s.error().text;
  };
  const Bytes level = quat(1, 0, 0, 0), origin = vec(0, 0, 0);
  EXPECT_THAT(why(pose_bytes(0, origin, level)), HasSubstr("frame is missing"));
  EXPECT_THAT(why(pose_bytes(9, origin, level)), HasSubstr("frame has an unknown value"));
  EXPECT_THAT(why(pose_bytes(2, vec(nan, 0, 0), level)), HasSubstr("position has a NaN"));
  EXPECT_THAT(why(pose_bytes(2, vec(0, -std::numeric_limits<double>::infinity(), 0), level)),
              HasSubstr("position has a NaN or inf"));
  EXPECT_THAT(why(pose_bytes(2, vec(0, 0, 1e300), level)), HasSubstr("1e8 m"));
  EXPECT_THAT(why(pose_bytes(2, origin, quat(nan, 0, 0, 0))), HasSubstr("orientation has a NaN"));
  EXPECT_THAT(why(pose_bytes(2, origin, quat(0, 0, 0, 0))), HasSubstr("norm 0.0"));
  EXPECT_THAT(why(pose_bytes(2, origin, quat(1.002, 0, 0, 0))), HasSubstr("normalise it"));
  EXPECT_EQ(why(pose_bytes(2, origin, quat(1.0009, 0, 0, 0))), "accepted");
  EXPECT_THAT(why(Wire{}.varint(4, 2).sub(6, level).out), HasSubstr("position is missing"));
  EXPECT_THAT(why(Wire{}.varint(4, 2).sub(5, origin).out), HasSubstr("orientation is missing"));
  for (const std::int64_t far : {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min(),
                                 std::int64_t{4'500'000'000'000'000'001}})
    for (const unsigned domain : {1u, 2u, 3u})
      EXPECT_THAT(why(Wire{}.sub(3, Wire{}.varint(1, domain).fixed64(2, &far).out).varint(4, 2).sub(5, origin).sub(6, level).out),
                  HasSubstr("beyond 4.5e18 ns"));
  const std::int64_t ns = 5;
  EXPECT_THAT(why(Wire{}.sub(3, Wire{}.fixed64(2, &ns).out).varint(4, 2).sub(5, origin).sub(6, level).out),
              HasSubstr("time.domain"));
  Wire twist;
  twist.varint(4, 2).sub(5, origin).sub(6, level).sub(7, Wire{}.sub(1, vec(nan, 0, 0)).out);
  EXPECT_THAT(why(twist.out), HasSubstr("velocity"));
  EXPECT_THAT(why(text("garbage!")), HasSubstr("not a PoseUpdate"));
  EXPECT_THAT(why({}), HasSubstr("not a PoseUpdate"));
  EXPECT_THAT(why(Bytes(1201)), HasSubstr("1200"));
}

TEST(Control, IllFormedNamesAreRefusedWithoutALineOnStderr) {
  Wire w;
  w.sub(1, text("\xff\xfe")).varint(2, 7).varint(4, 2).sub(5, vec(0, 0, 0)).sub(6, quat(1, 0, 0, 0));
  testing::internal::CaptureStderr();
  const auto refused = decode_pose_datagram(w.out);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_FALSE(refused.has_value());
}

TEST(Control, ANormThatDiffersSlightlyFromOneIsRepaired) {
  const auto s = decode_pose_datagram(pose_bytes(2, vec(0, 0, 0), quat(1.0005, 0, 0, 0)));
  ASSERT_TRUE(s);
  EXPECT_NEAR(norm_squared(s->pose.orientation), 1, 1e-14);
}

TEST(Control, BothFramesRoundTrip) {
  for (const Frame frame : {Frame::ned_frd, Frame::enu_flu}) {
    PoseSample s;
    s.name = "rov";
    s.seq = 42;
    s.stamp = {ClockDomain::wall, -17};
    s.pose = {{1, -2, 3}, quat_from_rpy({0.1, -0.2, 0.3})};
    s.velocity_mps = Vec3d{1, 2, 3};
    s.angular_velocity_radps = Vec3d{0.1, 0.2, 0.3};
    s.sent_in = frame;
    const auto back = decode_pose_datagram(encode_pose_datagram(s));
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->sent_in, frame);
    EXPECT_EQ(back->stamp.ns, -17);
    EXPECT_NEAR(length(back->pose.position_m - s.pose.position_m), 0, 1e-12);
    const Quatd d = conjugate(back->pose.orientation) * s.pose.orientation;
    EXPECT_NEAR(std::abs(d.w), 1, 1e-12);
    EXPECT_NEAR(length(*back->velocity_mps - *s.velocity_mps), 0, 1e-12);
    EXPECT_NEAR(length(*back->angular_velocity_radps - *s.angular_velocity_radps), 0, 1e-12);
  }
}

TEST(Control, RequestsAndResponsesRoundTrip) {
  const auto hello = decode_request(encode_request({5, Hello{1, "test"}}));
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->id, 5u);
  EXPECT_EQ(std::get<Hello>(hello->op).name, "test");
  PoseSample crate;
  crate.of = PoseSample::Of::object;
  crate.name = "crate";
  crate.hidden = true;
  const auto object = decode_request(encode_request({6, crate}));
  ASSERT_TRUE(object) << object.error().why;
  EXPECT_TRUE(std::get<PoseSample>(object->op).hidden);
  EXPECT_EQ(std::get<PoseSample>(object->op).of, PoseSample::Of::object);
  EXPECT_TRUE(std::holds_alternative<Unsupported>(decode_request(encode_request({7, Unsupported{}}))->op));
}

TEST(Control, ARefusedRequestKeepsItsId) {
  const Bytes bad = Wire{}.varint(1, 99).sub(12, pose_bytes(0, vec(0, 0, 0), quat(1, 0, 0, 0))).out;
  const auto r = decode_request(bad);
  ASSERT_FALSE(r);
  EXPECT_EQ(r.error().id, 99u);
  EXPECT_THAT(r.error().why, HasSubstr("frame is missing"));
  EXPECT_EQ(decode_request(text("\xff\xff")).error().id, 0u);
}

TEST(Control, TruncationsAndFlippedBytesAreReadOrRefusedNeverFatal) {
  PoseSample s;
  s.name = "rov";
  s.seq = 3;
  s.stamp = {ClockDomain::sim, 123456789};
  s.velocity_mps = Vec3d{1, 2, 3};
  for (const Bytes& whole : {encode_pose_datagram(s), encode_request({5, s}), encode_request({6, Hello{}})}) {
    const auto try_both = [](const Bytes& bytes) {
      const auto pose = decode_pose_datagram(bytes);
      if (pose) {
        EXPECT_TRUE(is_finite(pose->pose.position_m));
        EXPECT_NEAR(norm_squared(pose->pose.orientation), 1, 1e-9);
      }
      const auto request = decode_request(bytes);
      if (!request) {
        EXPECT_FALSE(request.error().why.empty());
      }
    };
    for (std::size_t n = 0; n < whole.size(); ++n) try_both(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)));
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        Bytes flipped = whole;
        flipped[at] ^= static_cast<std::byte>(1 << bit);
        try_both(flipped);
      }
    }
  }
}

TEST(Delimited, EverySplitGivesTheSameMessages) {
  Bytes stream;
  const std::vector<std::size_t> sizes = {0, 1, 127, 128, 300};
  for (const std::size_t n : sizes) {
    const Bytes framed = delimited(Bytes(n, static_cast<std::byte>(n)));
    stream.insert(stream.end(), framed.begin(), framed.end());
  }
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    DelimitedParser parser;
    std::vector<std::size_t> seen;
    const auto drain = [&] {
      for (auto m = parser.next(); m && *m; m = parser.next()) seen.push_back((*m)->size());
    };
    parser.feed(std::span(stream).first(cut));
    drain();
    parser.feed(std::span(stream).subspan(cut));
    drain();
    ASSERT_EQ(seen, sizes) << "cut at " << cut;
  }
}

TEST(Delimited, RefusesLengthsBeyondTheCap) {
  DelimitedParser parser;
  const Bytes length = {std::byte{0x81}, std::byte{0x80}, std::byte{0x40}};  // 2^20 + 1
  parser.feed(length);
  const auto r = parser.next();
  ASSERT_FALSE(r);
  EXPECT_THAT(r.error().text, HasSubstr("limit of 1048576"));
  DelimitedParser careful(100);
  careful.feed(Bytes{std::byte{101}});
  EXPECT_FALSE(careful.next());
  DelimitedParser endless;
  endless.feed(Bytes(6, std::byte{0xff}));
  ASSERT_FALSE(endless.next());
}

}  // namespace
}  // namespace sonar::control
