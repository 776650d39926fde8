// The options of the command line for the address of the farm's queue.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace sonar::farm {

struct QueueOptions {
  std::string url = "nats://127.0.0.1:4222";  // several URLs are separated by commas
  std::filesystem::path credentials;          // a NATS credentials file; empty = none
  std::filesystem::path token_file;
  /// connect() calls this function with the reason if no server answers, and tries again if it returns true. Empty: connect()
  /// tries once.
  std::function<bool(const std::string& why)> try_again{};
};

}  // namespace sonar::farm
