// Several sonars on one engine: a quick ping interrupts a long one, a sonar that has used more time waits, and a sonar that
// paused has no advantage later.
#include "daemon/server/engine/simulator.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

namespace sonar {
namespace {

constexpr std::uint32_t slow = 0, quick = 1;

TEST(FairTurns, AQuickSonarThatHasUsedLessTimeGoesFirst) {
  FairTurns turns;
  turns.ask(slow), turns.ask(quick);
  turns.end(slow, 0.1), turns.end(quick, 0.01);
  EXPECT_TRUE(turns.goes_first(quick, slow, 0.005));
  EXPECT_FALSE(turns.goes_first(quick, slow, 0.095)) << "the slow ping is nearly done";
  EXPECT_FALSE(turns.goes_first(slow, quick, 0));
}

TEST(FairTurns, AQuickSonarThatHasUsedMoreTimeWaits) {
  FairTurns turns;
  turns.ask(slow), turns.ask(quick);
  turns.end(slow, 0.1);
  for (int i = 0; i < 20; ++i) turns.end(quick, 0.01);
  EXPECT_FALSE(turns.goes_first(quick, slow, 0.005)) << "the quick sonar has used 0.2 s, the slow one 0.105 s";
}

TEST(FairTurns, IdleTimeGivesNoCredit) {
  FairTurns turns;
  turns.ask(slow), turns.ask(quick);
  for (int i = 0; i < 50; ++i) turns.begin(slow), turns.end(slow, 0.1);
  turns.ask(quick);
  EXPECT_NEAR(turns.used_s(quick), 4.9, 1e-9) << "the time that the slow sonar had used when its last ping began";
}

TEST(FairTurns, ASonarWhoseTimeIsUnknownMayNotInterrupt) {
  FairTurns turns;
  turns.ask(slow), turns.ask(quick);
  turns.end(slow, 0.1);
  EXPECT_FALSE(turns.goes_first(quick, slow, 0));
}

/// Takes 100 ms for the slow sonar, in 20 parts, and 1 ms for the quick one. Each part ends when the quick sonar requests a
/// ping, so that a busy machine does not delay the quick one's requests beyond the parts.
class Parts final : public PingEngine {
 public:
  std::atomic<int> quick_asked = 0;

  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    const auto wait = [](int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); };
    if (requests.front().sonar_id == quick) wait(1), --quick_asked;
    for (int part = 0; requests.front().sonar_id == slow && part < 20; ++part) {
      wait(5);
      for (int turns = 0; quick_asked == 0 && turns < 1000; ++turns) wait(1);
      if (interruption_) interruption_->run_other();
    }
    Ping ping;
    ping.request = requests.front();
    return {ping};
  }
  void set_interruption(Interruption* interruption) override { interruption_ = interruption; }
  std::string description() const override { return "parts"; }

 private:
  Interruption* interruption_ = nullptr;
};

TEST(Simulator, AQuickSonarKeepsItsRateBesideASlowOne) {
  asio::io_context io;
  auto engine = std::make_unique<Parts>();
  Parts& parts = *engine;
  Simulator simulator(io, std::move(engine), 0);
  int slow_pings = 0, quick_pings = 0;
  double quick_seconds = 0, slow_seconds = 0;
  const std::function<void(std::uint32_t)> ask = [&](std::uint32_t sonar) {
    PingRequest request;
    request.sonar_id = sonar;
    if (sonar == quick) ++parts.quick_asked;
    simulator.submit(request, [&, sonar](Simulator::Outcome outcome) {
      ASSERT_TRUE(outcome.ping) << outcome.failure;
      ++(sonar == slow ? slow_pings : quick_pings);
      (sonar == slow ? slow_seconds : quick_seconds) += outcome.seconds;
      if (slow_pings < 5) ask(sonar);
    });
  };
  ask(slow), ask(quick);
  io.run();
  EXPECT_GE(slow_pings, 5);
  EXPECT_GE(quick_pings, 25) << "5 in strict turns; 100 would fit between the parts of the slow pings";
  EXPECT_LT(quick_seconds / quick_pings, 0.5 * slow_seconds / slow_pings) << "each sonar's time is counted separately";
}

constexpr std::uint32_t wrong = 99, large = 98;

/// Computes up to three pings of one size together; an invalid request makes the whole call fail. The first call waits for the
/// requests of all sonars.
class Together final : public PingEngine {
 public:
  Together(std::vector<std::vector<std::uint32_t>>& calls, std::shared_future<void> all_asked)
      : calls_(calls), all_asked_(std::move(all_asked)) {}
  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    calls_.emplace_back();
    all_asked_.wait();
    std::vector<Ping> pings(requests.size());
    for (std::size_t i = 0; i < requests.size(); ++i) {
      calls_.back().push_back(requests[i].sonar_id);
      if (requests[i].sonar_id == wrong) throw std::invalid_argument("wrong");
      pings[i].request = requests[i];
    }
    return pings;
  }
  std::size_t most_together(const PingRequest& a, const PingRequest& b) const override {
    return a.settings.beam_count == b.settings.beam_count ? 3 : 1;
  }
  std::string description() const override { return "together"; }

 private:
  std::vector<std::vector<std::uint32_t>>& calls_;
  std::shared_future<void> all_asked_;
};

TEST(Simulator, PassesRequestsOfSeveralSonarsToAnEngineThatComputesThemTogether) {
  asio::io_context io;
  std::vector<std::vector<std::uint32_t>> calls;
  std::vector<std::uint32_t> answered;
  {
    std::promise<void> all_asked;
    Simulator simulator(io, std::make_unique<Together>(calls, all_asked.get_future().share()), 0);
    for (const std::uint32_t sonar : {0u, 1u, 2u, 3u, 4u, wrong, large}) {
      PingRequest request;
      request.sonar_id = sonar;
      if (sonar == large) request.settings.beam_count *= 4;
      simulator.submit(request, [&, sonar](Simulator::Outcome outcome) {
        EXPECT_EQ(outcome.refused, sonar == wrong);
        EXPECT_EQ(outcome.failure, sonar == wrong ? "wrong" : "");
        if (outcome.ping) answered.push_back(outcome.ping->request.sonar_id);
      });
    }
    all_asked.set_value();
    io.run();
  }
  EXPECT_EQ(answered, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, large}));
  const std::vector<std::vector<std::uint32_t>> expected{{0}, {1, 2, 3}, {4, wrong}, {4}, {wrong}, {large}};
  EXPECT_EQ(calls, expected) << "after an invalid request, its partner is computed alone; a large ping delays no other";
}

struct SeenOn final : PingFindings {
  std::thread::id thread = std::this_thread::get_id();
};
struct Looking final : VendorSettings {
  bool equals(const VendorSettings&) const override { return true; }
  std::shared_ptr<const PingFindings> look_at(const Ping& ping) const override {
    if (ping.request.sonar_id == wrong) throw std::bad_alloc();
    ++looks;
    return std::make_shared<const SeenOn>();
  }
  mutable std::atomic<int> looks = 0;
};

TEST(Simulator, MeasuresAPingOnceOnTheThreadThatComputesIt) {
  asio::io_context io;
  std::vector<std::vector<std::uint32_t>> calls;
  std::promise<void> all_asked;
  Simulator simulator(io, std::make_unique<Together>(calls, all_asked.get_future().share()), 0);
  const auto settings = std::make_shared<Looking>();
  for (const std::uint32_t sonar : {0u, 1u, 2u, wrong}) {
    PingRequest request;
    request.sonar_id = sonar;
    request.vendor_settings = settings;
    if (sonar == wrong) request.settings.beam_count *= 4;
    simulator.submit(request, [&, sonar](Simulator::Outcome outcome) {
      EXPECT_EQ(outcome.refused, sonar == wrong);
      if (sonar == wrong) return;
      const auto* const seen = dynamic_cast<const SeenOn*>(outcome.ping->findings.get());
      ASSERT_NE(seen, nullptr);
      EXPECT_NE(seen->thread, std::this_thread::get_id());
    });
  }
  all_asked.set_value();
  io.run();
  EXPECT_EQ(settings->looks, 3);
}

}  // namespace
}  // namespace sonar
