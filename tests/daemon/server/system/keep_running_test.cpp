// Tests that the loop of a listener is restarted after an exception, unless the handler decides to end it.
#include <gmock/gmock.h>

#include <stdexcept>
#include <vector>

#include "daemon/server/system/asio.hpp"

namespace sonar {
namespace {

using ::testing::ElementsAre;

struct Loop {
  asio::io_context io;
  int runs = 0, faults = 0;
  std::vector<std::string> reported;
  asio::awaitable<void> run() {
    ++runs;
    if (runs <= faults) throw std::runtime_error("fault " + std::to_string(runs));
    co_return;
  }
  void keep_running(std::size_t survived) {
    sonar::keep_running(
        io.get_executor(), [this] { return run(); },
        [this, survived](const std::string& fault) {
          reported.push_back(fault);
          return reported.size() <= survived;
        });
    io.run();
  }
};

TEST(KeepRunning, RestartsTheLoopAfterExceptionsUntilItEnds) {
  Loop loop;
  loop.faults = 2;
  loop.keep_running(5);
  EXPECT_EQ(loop.runs, 3);
  EXPECT_THAT(loop.reported, ElementsAre("fault 1", "fault 2"));
}

TEST(KeepRunning, EndsIfTheHandlerReturnsFalse) {
  Loop loop;
  loop.faults = 9;
  loop.keep_running(1);
  EXPECT_EQ(loop.runs, 2);
}

}  // namespace
}  // namespace sonar
