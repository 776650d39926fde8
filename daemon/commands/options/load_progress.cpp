#include "daemon/commands/options/load_progress.hpp"

#include <cstdio>

#include "core/base/load_step.hpp"

namespace sonar {

LoadProgress::LoadProgress(Say say, std::chrono::milliseconds every)
    : thread_([say = std::move(say), every, ended = ended_.get_future()] {
        const auto begin = std::chrono::steady_clock::now();
        while (ended.wait_for(every) == std::future_status::timeout) {
          const LoadStep step = load_step();
          if (step.what.empty()) continue;  // the scene is small
          std::string line = "loading the scene: " + step.what + ", ";
          if (step.part > 0) line += std::to_string(static_cast<int>(100 * step.part)) + " %, ";
          const auto passed = std::chrono::steady_clock::now() - begin;
          say(line + std::to_string(std::chrono::duration_cast<std::chrono::seconds>(passed).count()) + " s");
        }
      }) {}

LoadProgress::~LoadProgress() {
  ended_.set_value();
  thread_.join();
}

void LoadProgress::to_console(const std::string& line) { std::fprintf(stderr, "sonard: %s\n", line.c_str()); }

}  // namespace sonar
