// Tests a device that fails, at every possible call. No ping is lost, or the engine reports that it cannot continue.
#include "tests/cuda/failing_machine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/pipeline/pulses/spectral_transform.hpp"
#include "cuda/device_engine.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int never = std::numeric_limits<int>::max();

double no_time() { return 0; }

class LostDevice : public ::testing::Test {
 protected:
  LostDevice() {
    SceneMaker maker;
    maker.add(height_field(0, 4, -2, 2, 0.5, [](double, double) { return 0.0; }), -25, {0, 0, -1});
    scene_ = maker.make();
    SonarModel model;
    model.name = "test";
    model.modes = {p900()};
    model.modes[0].pattern.azimuth_width_rad *= 4;  // few cells
    PingRequest r;
    r.model = std::make_shared<const SonarModel>(std::move(model));
    r.settings = default_rows(3, 30);
    r.settings.beam_count = 32;
    r.sonar_in_world = {{0, 0, 0}, quat_from_rpy({0, 0.4, 0})};
    for (std::uint32_t i = 0; i < 5; ++i) {
      r.number = PingNumber{i};
      requests_.push_back(r);
    }
    if (spectral::have_transform) {  // one ping that is transformed on the device
      SonarModel exact = *requests_[3].model;
      exact.modes[0].waveform.shape = Waveform::Shape::cw;
      exact.modes[0].waveform.exact = true;
      requests_[3].model = std::make_shared<const SonarModel>(std::move(exact));
    }
    for (const Ping& ping : make_cpu_engine(scene_, pool_, options_)->run(requests_)) samples_.push_back(ping.samples);
  }
  std::unique_ptr<PingEngine> engine(int last_call, bool cpu_after_failure) {
    calls_ = 0;
    said_.clear();
    cuda::DeviceEngineOptions device;
    device.batch = 2;
    device.cpu_after_failure = cpu_after_failure;
    device.say = [this](const std::string& what) { said_.push_back(what); };
    return cuda::make_device_engine(scene_, pool_, options_, std::make_unique<FailingMachine>(calls_, last_call), device);
  }
  /// Submits calls of two requests. Each is submitted before the previous one is collected.
  static std::vector<Ping> pipelined(PingEngine& engine, std::span<const PingRequest> requests) {
    std::vector<Ping> pings;
    const auto collect = [&] {
      for (Ping& ping : engine.collect()) pings.push_back(std::move(ping));
    };
    for (std::size_t i = 0; i < requests.size(); i += 2) {
      engine.submit(requests.subspan(i, std::min<std::size_t>(2, requests.size() - i)));
      if (i > 0) collect();
    }
    collect();
    return pings;
  }
  Parallel pool_{1};
  EngineOptions options_{.simd = SimdLevel::portable, .now_s = no_time};
  std::shared_ptr<const Scene> scene_;
  std::vector<PingRequest> requests_;
  std::vector<std::vector<std::byte>> samples_;  // samples of the CPU
  int calls_ = 0;
  std::vector<std::string> said_;
};

TEST_F(LostDevice, IsReplacedByTheCpuFromThePingItLost) {
  int first = 0, all = 0;
  {
    const auto sound = engine(never, true);
    first = calls_;
    sound->run(requests_);
    all = calls_;  // number of calls before the waits at the end
    EXPECT_TRUE(said_.empty());
    EXPECT_THAT(sound->description(), StartsWith("cuda, "));
  }
  ASSERT_GT(first, 5);
  ASSERT_GE(all - first, 40);
  for (int last = first; last < all; ++last) {
    const auto lost = engine(last, true);
    for (const std::size_t count : {requests_.size(), std::size_t{1}}) {  // also some time after the failure
      const auto pings = lost->run(std::span(requests_).first(count));
      ASSERT_EQ(pings.size(), count);
      for (std::size_t i = 0; i < pings.size(); ++i) {
        EXPECT_EQ(pings[i].request.number, requests_[i].number);
        ASSERT_EQ(pings[i].samples, samples_[i]) << "lost at call " << last << ", ping " << i;
      }
    }
    ASSERT_EQ(said_.size(), 1u) << last;
    EXPECT_EQ(said_[0], "the CUDA engine stopped: the device is lost; from here on the CPU computes");
    EXPECT_THAT(lost->description(), StartsWith("cpu, after a failure of a device that fails"));
  }
}

// Calls that were collected before the failure come from the device, all others from the CPU.
TEST_F(LostDevice, LosesNoPingOfCallsThatAreUnderWay) {
  const int first = (engine(never, true), calls_);
  const auto sound = engine(never, true);
  const std::vector<Ping> there = pipelined(*sound, requests_);
  const int all = calls_;
  std::size_t most = 0;
  for (int last = first; last < all; ++last) {
    const auto lost = engine(last, true);
    const auto pings = pipelined(*lost, requests_);
    ASSERT_EQ(pings.size(), requests_.size());
    std::size_t collected = 0;
    while (collected < pings.size() && pings[collected].samples == there[collected].samples) ++collected;
    most = std::max(most, collected);
    for (std::size_t i = collected; i < pings.size(); ++i)
      ASSERT_EQ(pings[i].samples, samples_[i]) << "lost at " << last << ", ping " << i;
    ASSERT_EQ(said_.size(), 1u) << last;
    const auto end = engine(last, false);
    EXPECT_THROW(pipelined(*end, requests_), EngineUnavailable) << last;
  }
  EXPECT_GE(most, 4u) << "two calls of two pings were never collected before the failure";
}

TEST_F(LostDevice, IsAnErrorIfTheCpuMayNotReplaceIt) {
  const int first = (engine(never, false), calls_);
  for (const int last : {first, first + 1, first + 20}) {
    const auto lost = engine(last, false);
    for (int again = 0; again < 2; ++again) {
      try {
        lost->run(requests_);
        ADD_FAILURE() << "nothing was thrown: " << last;
      } catch (const EngineUnavailable& e) {
        EXPECT_STREQ(e.what(), "the CUDA engine stopped: the device is lost; use --engine cpu or auto");
      }
    }
    EXPECT_TRUE(said_.empty());
  }
}

TEST_F(LostDevice, ContinuesAfterAnErrorOfTheProgram) {
  const auto sound = engine(never, true);
  const int first = calls_;
  const std::vector<Ping> there = sound->run(requests_);
  const int all = calls_;
  int thrown = 0;
  for (int last = first; last < all; ++last) {
    calls_ = 0;
    auto machine = std::make_unique<FailingMachine>(calls_, last);
    machine->has_fault = true;
    cuda::DeviceEngineOptions device;
    device.batch = 2;
    const auto faulty = cuda::make_device_engine(scene_, pool_, options_, std::move(machine), device);
    try {
      faulty->run(requests_);
    } catch (const std::logic_error&) {
      ++thrown;
    }
    const std::vector<Ping> pings = faulty->run(requests_);
    ASSERT_EQ(pings.size(), there.size());
    for (std::size_t i = 0; i < pings.size(); ++i) ASSERT_EQ(pings[i].samples, there[i].samples) << last << ", ping " << i;
  }
  EXPECT_GT(thrown, 0);
}

TEST_F(LostDevice, GetsNoTransformsThatItDoesNotHave) {
  if (!spectral::have_transform) GTEST_SKIP() << "no exact pulses in this build";
  auto machine = std::make_unique<FailingMachine>(calls_, never);
  machine->no_transforms = "no libcufft.so.12";
  cuda::DeviceEngineOptions device;
  device.say = [this](const std::string& what) { said_.push_back(what); };
  const auto sound = cuda::make_device_engine(scene_, pool_, options_, std::move(machine), device);
  const auto pings = sound->run(requests_);
  EXPECT_EQ(pings[3].samples, samples_[3]);
  sound->run(requests_);
  ASSERT_EQ(said_.size(), 1u);
  EXPECT_EQ(said_[0], "CUDA: pings with an exact pulse are computed by the CPU (no libcufft.so.12)");
}

/// A device whose memory is full is not lost. All its memory is released, batches become smaller, and no ping is lost.
TEST_F(LostDevice, AFullDeviceIsNotLost) {
  constexpr std::size_t megabyte = 1u << 20;
  const std::vector<Ping> there = engine(never, false)->run(requests_);
  bool any_full = false, all_fit = false;
  for (std::size_t room_bytes = 36 * megabyte; !all_fit; room_bytes += 6 * megabyte) {
    ASSERT_LT(room_bytes, 200 * megabyte);
    auto machine = std::make_unique<FailingMachine>(calls_, never);
    machine->room_bytes = room_bytes;
    said_.clear();
    cuda::DeviceEngineOptions device;
    device.batch = 4;
    device.cpu_after_failure = false;
    device.say = [this](const std::string& what) { said_.push_back(what); };
    const auto full = cuda::make_device_engine(scene_, pool_, options_, std::move(machine), device);
    try {
      for (int again = 0; again < 2; ++again) {
        const auto pings = again > 0 ? pipelined(*full, requests_) : full->run(requests_);
        ASSERT_EQ(pings.size(), there.size());
        for (std::size_t i = 0; i < pings.size(); ++i) EXPECT_EQ(pings[i].samples, there[i].samples) << room_bytes << ", " << i;
      }
      all_fit = said_.empty();
      any_full = any_full || !all_fit;
    } catch (const EngineUnavailable&) {
      EXPECT_FALSE(any_full) << "a device with less memory was large enough: " << room_bytes;
      EXPECT_EQ(said_.size(), 3u) << "the engine tries batches of 4, 2 and 1 pings, then one batch at a time";
    }
    for (const std::string& what : said_) EXPECT_THAT(what, StartsWith("CUDA: the device's memory is full; from here on "));
  }
  EXPECT_TRUE(any_full) << "no device was too small";
}

TEST_F(LostDevice, ADeviceWithoutMemoryForAPingCountsAsLost) {
  auto machine = std::make_unique<FailingMachine>(calls_, never);
  machine->room_bytes = 8u << 20;
  cuda::DeviceEngineOptions device;
  device.say = [this](const std::string& what) { said_.push_back(what); };
  const auto full = cuda::make_device_engine(scene_, pool_, options_, std::move(machine), device);
  const auto pings = full->run(requests_);
  for (std::size_t i = 0; i < pings.size(); ++i) EXPECT_EQ(pings[i].samples, samples_[i]) << i;
  EXPECT_EQ(said_.back(), "the CUDA engine stopped: out of memory; from here on the CPU computes");
}

TEST_F(LostDevice, NoEngineIsMadeIfTheDeviceIsLostDuringTheUpload) {
  const int first = (engine(never, true), calls_);
  for (int last = 0; last < first; ++last) EXPECT_THROW(engine(last, true), std::runtime_error) << last;
}

}  // namespace
}  // namespace sonar::test
