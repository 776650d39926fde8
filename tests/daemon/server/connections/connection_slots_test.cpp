// The choice of the connection that is evicted for a new one.
#include "daemon/server/connections/connection_services.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace sonar {
namespace {

using Steady = std::chrono::steady_clock;

struct Visitor {
  std::string owner;
  Steady::time_point active_at;
  bool proved = true;
  bool closed = false;
  void close() { closed = true; }
};
using Pointer = std::shared_ptr<Visitor>;

Pointer visitor(const std::string& owner, int silent_s) {
  return std::make_shared<Visitor>(Visitor{owner, Steady::now() - std::chrono::seconds(silent_s)});
}

TEST(ConnectionSlots, EvictTheLongestIdleUnlessAllAreBusy) {
  ConnectionSlots<Visitor> slots(2);
  const Pointer a = visitor("x", 3), b = visitor("y", 9);
  slots.add(a);
  slots.add(b);
  EXPECT_TRUE(slots.make_room("z", [&](const Visitor& v) { EXPECT_EQ(&v, b.get()); }));
  EXPECT_TRUE(b->closed);
  a->active_at = Steady::now() + std::chrono::hours(1);
  slots.add(visitor("z", -3600));
  EXPECT_FALSE(slots.make_room("z", [](const Visitor&) { FAIL(); }));
}

TEST(ConnectionSlots, EvictOneOfTheOwnerWithMost) {
  ConnectionSlots<Visitor> slots(4, {}, [](const Visitor& v) { return v.owner; });
  const Pointer alone = visitor("alone", 60);
  const std::vector<Pointer> crowd{visitor("crowd", 2), visitor("crowd", 5), visitor("crowd", 1)};
  slots.add(alone);
  for (const Pointer& v : crowd) slots.add(v);
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(slots.make_room("crowd", [](const Visitor& v) { EXPECT_EQ(v.owner, "crowd"); }));
    slots.add(visitor("crowd", 0));
  }
  EXPECT_TRUE(crowd[0]->closed && crowd[1]->closed && crowd[2]->closed);
  EXPECT_FALSE(alone->closed);
}

TEST(ConnectionSlots, AConnectionWithoutARequestIsReplacedFirst) {
  ConnectionSlots<Visitor> slots(2);
  const Pointer idle = visitor("x", 60), begins = visitor("x", 0);
  begins->proved = false;
  slots.add(idle);
  slots.add(begins);
  EXPECT_TRUE(slots.make_room("x", [&](const Visitor& v) { EXPECT_EQ(&v, begins.get()); }));
  EXPECT_TRUE(begins->closed);
  EXPECT_FALSE(idle->closed);
}

TEST(ConnectionSlots, AnAddressWithFewerConnectionsReplacesABusyOne) {
  ConnectionSlots<Visitor> slots(3, std::chrono::seconds(1), [](const Visitor& v) { return v.owner; });
  for (int i = 0; i < 3; ++i) slots.add(visitor("crowd", -3600));
  EXPECT_FALSE(slots.make_room("crowd", [](const Visitor&) { FAIL(); }));
  EXPECT_TRUE(slots.make_room("alone", [](const Visitor& v) { EXPECT_EQ(v.owner, "crowd"); }));
  slots.add(visitor("alone", -3600));
  EXPECT_FALSE(slots.make_room("alone", [](const Visitor&) { FAIL(); }))
      << "two connections of one address may not become two of the other";
}

}  // namespace
}  // namespace sonar
