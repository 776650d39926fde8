// Reports the progress of a long load, on a console or in the log.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <string>
#include <thread>

namespace sonar {

/// Reports the state of a load periodically: "loading the scene: reading wreck.ply, 45 %, 12 s". Reports nothing if the load ends
/// before the first report, or the scene is small.
class LoadProgress {
 public:
  using Say = std::function<void(const std::string& line)>;  // called on a separate thread
  explicit LoadProgress(Say say, std::chrono::milliseconds every = std::chrono::seconds(2));
  ~LoadProgress();
  LoadProgress(const LoadProgress&) = delete;
  LoadProgress& operator=(const LoadProgress&) = delete;

  /// Reports to standard error, as commands do.
  static void to_console(const std::string& line);

 private:
  std::promise<void> ended_;
  std::thread thread_;
};

}  // namespace sonar
