// Who gives up a place to a newcomer.
#include "daemon/config/places.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace sonar {
namespace {

using Steady = std::chrono::steady_clock;

struct Visitor {
  std::string owner;
  Steady::time_point heard_at;
  bool closed = false;
  void close() { closed = true; }
};
using Pointer = std::shared_ptr<Visitor>;

Pointer visitor(const std::string& owner, int silent_s) {
  return std::make_shared<Visitor>(Visitor{owner, Steady::now() - std::chrono::seconds(silent_s)});
}

TEST(Places, TheMostSilentGoesUnlessAllAreBusy) {
  Places<Visitor> places(2);
  const Pointer a = visitor("x", 3), b = visitor("y", 9);
  places.add(a);
  places.add(b);
  EXPECT_TRUE(places.make_room([&](const Visitor& v) { EXPECT_EQ(&v, b.get()); }));
  EXPECT_TRUE(b->closed);
  a->heard_at = Steady::now() + std::chrono::hours(1);
  places.add(visitor("z", -3600));
  EXPECT_FALSE(places.make_room([](const Visitor&) { FAIL(); }));
}

TEST(Places, WithOwnersItIsOneOfTheOwnerWhoHasMost) {
  Places<Visitor> places(4, {}, [](const Visitor& v) { return v.owner; });
  const Pointer alone = visitor("alone", 60);
  const std::vector<Pointer> crowd{visitor("crowd", 2), visitor("crowd", 5), visitor("crowd", 1)};
  places.add(alone);
  for (const Pointer& v : crowd) places.add(v);
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(places.make_room([](const Visitor& v) { EXPECT_EQ(v.owner, "crowd"); }));
    places.add(visitor("crowd", 0));
  }
  EXPECT_TRUE(crowd[0]->closed && crowd[1]->closed && crowd[2]->closed);
  EXPECT_FALSE(alone->closed);
}

}  // namespace
}  // namespace sonar
