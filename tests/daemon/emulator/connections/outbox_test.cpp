// The rule of the outbox (docs/architecture.md): one message is being written, `depth` pings wait, messages stay whole, drops are
// counted.
#include "daemon/emulator/connections/outbox.hpp"

#include <gtest/gtest.h>

namespace sonar {
namespace {

void push(Outbox& box, int tag, std::size_t size = 100) {
  box.push_ping(std::make_shared<const Outbox::Bytes>(size, static_cast<std::byte>(tag)), static_cast<std::uint32_t>(tag));
}
Outbox::Bytes reply(int tag, std::size_t size = 16) { return Outbox::Bytes(size, static_cast<std::byte>(tag)); }
int tag_of(const Outbox::Message& m) { return m ? std::to_integer<int>(m.bytes->front()) : -1; }

TEST(Outbox, ReplacesTheOldestWaitingPingAndNeverTheOneBeingWritten) {
  Outbox box({1, WhenFull::replace_oldest});
  push(box, 1);
  const auto first = box.take();
  EXPECT_EQ(tag_of(first), 1);
  for (int i = 2; i <= 5; ++i) push(box, i);
  EXPECT_EQ(box.pings_dropped(), 3u);
  EXPECT_FALSE(box.take()) << "one message at a time";
  box.written();
  EXPECT_EQ(tag_of(box.take()), 5);
  box.written();
  EXPECT_TRUE(box.idle());
  EXPECT_EQ(box.pings_written(), 2u);
}

// With the fault `latency`, every ping is held back before it is sent. For a slow client their number must stay limited.
TEST(Outbox, HeldPingsMayPassTheDepthButNotTheirOwnLimit) {
  Outbox box({1, WhenFull::replace_oldest});
  const auto hold = [&](std::uint32_t number, std::size_t bytes) {
    box.push_held({.bytes = std::make_shared<const Outbox::Bytes>(bytes), .ping = number, .prefixes = {}, .fired_at = {}});
  };
  for (std::uint32_t i = 1; i <= 3 * Outbox::most_held; ++i) hold(i, 100);
  EXPECT_EQ(box.pings_waiting(), Outbox::most_held);
  EXPECT_EQ(box.pings_dropped(), 2 * Outbox::most_held);
  EXPECT_EQ(box.take().ping, 2 * Outbox::most_held + 1) << "the newest are kept";
  for (std::uint32_t i = 0; i < 20; ++i) hold(1000 + i, Outbox::most_held_bytes / 10);
  EXPECT_EQ(box.pings_waiting(), 10u);
}

TEST(Outbox, DropsTheNewestIfConfigured) {
  Outbox box({2, WhenFull::drop_newest});
  for (int i = 1; i <= 5; ++i) push(box, i);
  EXPECT_EQ(box.pings_dropped(), 3u);
  EXPECT_EQ(tag_of(box.take()), 1);
  box.written();
  EXPECT_EQ(tag_of(box.take()), 2);
}

TEST(Outbox, RepliesGoInOrderAndBeforeWaitingPings) {
  Outbox box({1, WhenFull::replace_oldest});
  push(box, 1);
  EXPECT_EQ(tag_of(box.take()), 1);
  push(box, 2);
  ASSERT_TRUE(box.push_reply(reply(10)));
  ASSERT_TRUE(box.push_reply(reply(11)));
  box.written();
  const auto first_reply = box.take();
  EXPECT_EQ(tag_of(first_reply), 10);
  EXPECT_EQ(first_reply.ping, 0u);
  box.written();
  EXPECT_EQ(tag_of(box.take()), 11);
  box.written();
  EXPECT_EQ(tag_of(box.take()), 2);
  box.written();
  EXPECT_EQ(box.pings_written(), 2u) << "replies are not pings";
}

TEST(Outbox, RepliesAreBoundedByCountAndBytes) {
  Outbox many({});
  for (std::size_t i = 0; i < Outbox::most_replies; ++i) ASSERT_TRUE(many.push_reply(reply(1)));
  EXPECT_FALSE(many.push_reply(reply(1)));
  Outbox large({});
  EXPECT_TRUE(large.push_reply(reply(1, Outbox::most_reply_bytes)));
  EXPECT_FALSE(large.push_reply(reply(1, 1)));
}

TEST(Outbox, WaitingPingsStayBelowEightMebibytes) {
  Outbox box({3, WhenFull::replace_oldest});
  push(box, 1, 5u << 20);
  push(box, 2, 5u << 20);
  EXPECT_EQ(box.pings_dropped(), 1u);
  EXPECT_EQ(tag_of(box.take()), 2);
  EXPECT_FALSE(box.take());
}

TEST(Outbox, DropWaitingPingsKeepsTheMessageBeingWrittenAndReplies) {
  Outbox box({2, WhenFull::replace_oldest});
  for (int i = 1; i <= 3; ++i) {
    push(box, i);
    if (i == 1) {
      EXPECT_EQ(tag_of(box.take()), 1);
    }
  }
  ASSERT_TRUE(box.push_reply(reply(9)));
  box.drop_waiting_pings();
  EXPECT_FALSE(box.idle());
  box.written();
  EXPECT_EQ(tag_of(box.take()), 9);
  box.written();
  EXPECT_TRUE(box.idle());
  EXPECT_EQ(box.pings_dropped(), 2u);
}

std::uint64_t dropped(const Outbox& box, DropReason why) { return box.dropped_by_reason()[static_cast<std::size_t>(why)]; }

TEST(Outbox, EveryPingOfferedIsWrittenOrDroppedForAReason) {
  Outbox box({2, WhenFull::replace_oldest});
  push(box, 1);
  ASSERT_TRUE(box.take());
  box.written();
  for (int i = 2; i <= 5; ++i) push(box, i);  // 4 and 5 wait, 2 and 3 were dropped
  ASSERT_TRUE(box.take());
  EXPECT_EQ(box.pings_waiting(), 1u);
  box.end(DropReason::gone);  // while 4 is being written
  EXPECT_TRUE(box.idle());
  EXPECT_EQ(box.pings_offered(), 5u);
  EXPECT_EQ(box.pings_written(), 1u);
  EXPECT_EQ(dropped(box, DropReason::slow), 2u);
  EXPECT_EQ(dropped(box, DropReason::gone), 2u) << "the ping that is being written, and the one that waits";
  EXPECT_EQ(dropped(box, DropReason::stop), 0u);
  EXPECT_EQ(box.pings_offered(), box.pings_written() + box.pings_dropped());
}

TEST(Outbox, AReplyThatIsCutDoesNotCountAsADroppedPing) {
  Outbox box({1, WhenFull::replace_oldest});
  ASSERT_TRUE(box.push_reply(reply(1)));
  ASSERT_TRUE(box.push_reply(reply(2)));
  ASSERT_TRUE(box.take());
  push(box, 1);
  box.drop_waiting_pings();
  box.end(DropReason::gone);
  EXPECT_TRUE(box.idle());
  EXPECT_EQ(dropped(box, DropReason::stop), 1u);
  EXPECT_EQ(box.pings_dropped(), 1u);
}

TEST(Outbox, AMessageHasTheTransmitTimeOfItsPing) {
  Outbox box({1, WhenFull::replace_oldest});
  const Time fired = Time(std::chrono::seconds(7));
  box.push_ping(std::make_shared<const Outbox::Bytes>(10), 1, {}, fired);
  EXPECT_EQ(box.take().fired_at, fired);
}

}  // namespace
}  // namespace sonar
