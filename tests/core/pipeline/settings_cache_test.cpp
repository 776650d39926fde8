// Tables of settings are kept up to a number of bytes. Tables in use are always kept.
#include "core/pipeline/settings_cache.hpp"

#include <gtest/gtest.h>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

constexpr std::size_t mebibyte = std::size_t{1} << 20;

struct Drivers {
  explicit Drivers(std::size_t most_bytes = SettingsCache::usual_bytes) : cache(most_bytes) {
    FrequencyMode mode = oculus_high();
    mode.receiver.shared_noise.level_db = 3.4f;
    sounding = std::make_unique<Sounding>(scene, mode, PingSettings{});
    sounding->request.switches.noise = true;
  }
  PreparedSettings& ask(double range_m, int beams = 512) {
    sounding->request.settings = default_rows(range_m, 700);
    sounding->request.settings.beam_count = beams;
    return cache.prepared_for(sounding->request, *scene, pool);
  }
  std::shared_ptr<const Scene> scene = SceneMaker().make();
  std::unique_ptr<Sounding> sounding;
  SettingsCache cache;
  Parallel pool;
};

TEST(SettingsCache, KeepsWhatFitsByBytes) {
  Drivers drivers(24 * mebibyte);
  for (int k = 0; k < 30; ++k) {
    drivers.ask(0.5 + 0.25 * k);
    EXPECT_LE(drivers.cache.bytes(), 24 * mebibyte) << k;
  }
  EXPECT_GT(drivers.cache.count(), 1u);
  EXPECT_LT(drivers.cache.count(), 12u);
}

TEST(SettingsCache, SmallTablesAreKeptByTheHundred) {
  Drivers drivers;
  for (int k = 0; k < 100; ++k) drivers.ask(20 + 0.1 * k, 16);
  EXPECT_EQ(drivers.cache.count(), 100u);
}

TEST(SettingsCache, ForgetsWhatWasUsedLeastRecently) {
  Drivers drivers(24 * mebibyte);
  const auto* kept = &drivers.ask(2);
  for (int k = 0; k < 20; ++k) {
    drivers.ask(0.5 + 0.25 * k + 0.1);
    EXPECT_EQ(&drivers.ask(2), kept) << k;
  }
}

TEST(SettingsCache, SettingsInUseStayEvenAboveTheLimit) {
  Drivers drivers(0);
  const auto& first = drivers.ask(2);
  EXPECT_TRUE(first.plan.shared_noise.is_audible());
  EXPECT_EQ(&drivers.ask(2), &first);
  drivers.ask(3);
  EXPECT_EQ(drivers.cache.count(), 1u);
}

TEST(SettingsCache, CountsTheTableOfSharedNoiseAndTheDraws) {
  Drivers drivers;
  const PreparedSettings& p = drivers.ask(2);
  const std::size_t draws = sizeof(float) * 2 * p.noise.shaped().size();  // white and filtered noise
  EXPECT_GE(drivers.cache.bytes(), p.plan.shared_noise.bytes() + draws);
  const std::size_t before = drivers.cache.bytes();
  drivers.ask(30, 16);  // shares the draws
  EXPECT_LT(drivers.cache.bytes(), before + mebibyte);
}

}  // namespace
}  // namespace sonar::test
