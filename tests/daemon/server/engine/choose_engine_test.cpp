// Choice of the engine: the CPU by default; a device that is missing is an error or a log line, as requested.
#include "daemon/server/engine/choose_engine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "daemon/server/engine/start_engine.hpp"

namespace sonar {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ChooseEngine : public ::testing::Test {
 protected:
  ChooseEngine() { setenv("SONARD_CUDA_MODULE", "/nowhere/libsonard_cuda.so", 1); }  // as on a machine without CUDA
  Result<std::unique_ptr<PingEngine>> choose(EngineDevice device) {
    auto scene = std::make_shared<Scene>();
    scene->name = "harbour";
    const auto make = [&](std::shared_ptr<const Scene> s) {
      return choose_engine(device, std::move(s), pool_, {}, [this](const std::string& what) { said_.push_back(what); });
    };
    return start_engine(make, scene);
  }
  Parallel pool_;
  std::vector<std::string> said_;
};

TEST_F(ChooseEngine, CpuIsChosenWithoutALogLine) {
  const auto engine = choose(EngineDevice::cpu);
  ASSERT_TRUE(engine);
  EXPECT_THAT((*engine)->description(), StartsWith("cpu, "));
  EXPECT_TRUE(said_.empty());
}

TEST_F(ChooseEngine, CudaWithoutADeviceGivesExitCode69AndTheReason) {
  const auto engine = choose(EngineDevice::cuda);
  ASSERT_FALSE(engine);
  EXPECT_EQ(exit_code(engine.error().kind), 69);
  EXPECT_THAT(engine.error().text, AllOf(HasSubstr("harbour"), HasSubstr("CUDA: not installed"), HasSubstr("--engine cpu")));
}

TEST_F(ChooseEngine, AutoFallsBackWithOneLine) {
  const auto engine = choose(EngineDevice::automatic);
  ASSERT_TRUE(engine);
  EXPECT_THAT((*engine)->description(), StartsWith("cpu, "));
  ASSERT_EQ(said_.size(), 1u);
  EXPECT_THAT(said_[0], HasSubstr("CUDA: not installed"));
}

}  // namespace
}  // namespace sonar
