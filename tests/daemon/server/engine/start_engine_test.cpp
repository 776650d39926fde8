// If this machine cannot start an engine, sonard prints a sentence and ends with exit code 69. Only our own mistakes are reported
// as bugs.
#include "daemon/server/engine/start_engine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <new>
#include <stdexcept>
#include <system_error>

namespace sonar {
namespace {

using ::testing::HasSubstr;

class Idle final : public PingEngine {
 public:
  std::vector<Ping> run(std::span<const PingRequest>) override { return {}; }
  std::string description() const override { return "idle"; }
};

std::shared_ptr<const Scene> harbour() {
  auto scene = std::make_shared<Scene>();
  scene->name = "harbour";
  return scene;
}
template <class Exception>
EngineFactory throwing(Exception e) {
  return [e](const std::shared_ptr<const Scene>&) -> std::unique_ptr<PingEngine> { throw e; };
}

TEST(StartEngine, ReturnsTheEngineThatWasMade) {
  const auto engine = start_engine([](const auto&) { return std::make_unique<Idle>(); }, harbour());
  ASSERT_TRUE(engine);
  EXPECT_EQ((*engine)->description(), "idle");
}

TEST(StartEngine, AMachineWithoutTheNeededDeviceGivesExitCode69) {
  const auto processor = start_engine(throwing(std::runtime_error("cannot start on this processor")), harbour());
  ASSERT_FALSE(processor);
  EXPECT_EQ(exit_code(processor.error().kind), 69);
  EXPECT_THAT(processor.error().text, HasSubstr("scene harbour: cannot start on this processor"));
  const auto memory = start_engine(throwing(std::bad_alloc()), harbour());
  ASSERT_FALSE(memory);
  EXPECT_EQ(exit_code(memory.error().kind), 69);
  EXPECT_THAT(memory.error().text, HasSubstr("not enough memory; use a smaller scene, or raise the limits of memory (ulimit -v"));
  const auto again = std::make_error_code(std::errc::resource_unavailable_try_again);
  for (const auto& make : {throwing(std::runtime_error("pthread_create failed")), throwing(std::system_error(again))}) {
    const auto thread = start_engine(make, harbour());
    ASSERT_FALSE(thread);
    EXPECT_EQ(exit_code(thread.error().kind), 69);
    EXPECT_THAT(thread.error().text, HasSubstr("scene harbour: cannot start a thread: allow this user or service more threads"));
  }
}

TEST(StartEngine, OtherExceptionsAreReportedAsBugs) {
  EXPECT_THROW(static_cast<void>(start_engine(throwing(std::logic_error("ours")), harbour())), std::logic_error);
}

}  // namespace
}  // namespace sonar
