#include "clients/bvtsdk/core/sonar.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

namespace sonar::bvt {
namespace {

struct Fish : Object {};
struct Boat : Object {};

std::uintptr_t number(void* handle) { return reinterpret_cast<std::uintptr_t>(handle); }

TEST(Handles, AreSmallAndDifferentAndSurviveBeingCutTo32Bits) {
  Handles table;
  std::set<std::uintptr_t> seen;
  for (int i = 0; i < 5000; ++i) {
    void* handle = table.add(std::make_shared<Fish>());
    ASSERT_NE(handle, nullptr);
    EXPECT_LT(number(handle), 1u << 31);
    EXPECT_TRUE(seen.insert(number(handle)).second);
    EXPECT_EQ(number(handle), static_cast<std::uintptr_t>(static_cast<int>(number(handle))));
  }
  EXPECT_EQ(table.live(), 5000u);
}

TEST(Handles, FindOnlyTheirOwnObject) {
  Handles table;
  const auto fish = std::make_shared<Fish>();
  void* handle = table.add(fish);
  EXPECT_EQ(table.find<Fish>(handle), fish);
  EXPECT_EQ(table.find<Boat>(handle), nullptr);
  EXPECT_EQ(table.remove<Boat>(handle), nullptr);
  EXPECT_EQ(table.find<Object>(handle), fish);
  EXPECT_EQ(table.find<Fish>(nullptr), nullptr);
  EXPECT_EQ(table.find<Fish>(&table), nullptr);  // a real address
  EXPECT_EQ(table.find<Fish>(reinterpret_cast<void*>(~std::uintptr_t{0})), nullptr);
}

TEST(Handles, StaleHandlesStayStaleWhenTheSlotIsReused) {
  Handles table;
  void* stale = table.add(std::make_shared<Fish>());
  EXPECT_NE(table.remove<Fish>(stale), nullptr);
  EXPECT_EQ(table.remove<Fish>(stale), nullptr);
  std::set<std::uintptr_t> used;
  for (int i = 0; i < 20000; ++i) {
    void* handle = table.add(std::make_shared<Fish>());
    used.insert(number(handle) & 0xFFFFF);
    ASSERT_NE(handle, stale);
    ASSERT_EQ(table.find<Fish>(stale), nullptr);
    table.remove<Fish>(handle);
  }
  EXPECT_LT(used.size(), 2000u);  // handles are reused
  EXPECT_GT(used.size(), 1000u);  // but not immediately
  EXPECT_EQ(table.live(), 0u);
}

TEST(Handles, ObjectsLiveWhileACallUsesThem) {
  Handles table;
  void* handle = table.add(std::make_shared<Fish>());
  const std::shared_ptr<Fish> held = table.find<Fish>(handle);
  const std::weak_ptr<Fish> watched = held;
  table.remove<Fish>(handle);
  EXPECT_FALSE(watched.expired());
}

TEST(Handles, ServeSeveralThreads) {
  Handles table;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&table] {
      for (int i = 0; i < 5000; ++i) {
        const auto fish = std::make_shared<Fish>();
        void* handle = table.add(fish);
        EXPECT_EQ(table.find<Fish>(handle), fish);
        EXPECT_EQ(table.remove<Fish>(handle), fish);
      }
    });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(table.live(), 0u);
}

}  // namespace
}  // namespace sonar::bvt
