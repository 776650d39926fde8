#include "tests/reliability/record.hpp"

#include <sys/utsname.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include "nlohmann/json.hpp"

namespace sonar::test {
namespace {

/// Returns e.g. "2 x Some Processor, Linux 6.1.0", without the name of the computer.
std::string machine() {
  std::string model = "processors";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);)
    if (line.starts_with("model name")) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  utsname system{};
  uname(&system);
  return std::to_string(std::thread::hardware_concurrency()) + " x " + model + ", " + system.sysname + " " + system.release;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

}  // namespace

bool record_reliability(const ReliabilityFigure& f) {
  const char* folder = std::getenv("SONARD_RELIABILITY");
  if (folder == nullptr || *folder == 0) return true;
  std::filesystem::create_directories(folder);
  std::ofstream out(std::filesystem::path(folder) / (f.item + ".json"));
  const nlohmann::ordered_json record = {{"item", f.item},       {"figure", f.figure},   {"bound", f.bound}, {"passed", f.passed},
                                         {"command", f.command}, {"machine", machine()}, {"date", today()}};
  out << record.dump(2) << '\n';
  return static_cast<bool>(out.flush());
}

}  // namespace sonar::test
