#include "tests/load/load_daemon.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <thread>

#include "daemon/config/load_config.hpp"
#include "daemon/server/app.hpp"
#include "tests/load/premade_engine.hpp"

namespace sonar::load {
namespace {

std::string yaml(const LoadSetup& setup, const std::vector<std::string>& addresses) {
  std::string text =
      "world: {scene: scene.yaml}\nvehicles:\n  - {name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, -3]}}\nsonars:\n";
  for (std::size_t i = 0; i < addresses.size(); ++i)
    text += "  - name: sonar" + std::to_string(i) + "\n    profile: oculus-m1200d\n    bind_ip: " + addresses[i] +
            "\n    status_to: ['" + addresses[i] + ":9']\n" + setup.sonar_lines;
  return text + "poses: {protobuf: '" + addresses[0] + ":14770', json: '" + addresses[0] + ":14771'}\n" + setup.more;
}

}  // namespace

struct LoadDaemon::Parts {
  std::vector<std::string> addresses;
  mutable std::mutex log_mutex;
  std::string log_text;
  std::unique_ptr<Log> log;
  std::unique_ptr<App> app;
  std::thread thread;
  int code = -1;
};

LoadDaemon::LoadDaemon(const LoadSetup& setup) : parts_(std::make_unique<Parts>()) {
  Parts& p = *parts_;
  for (int i = 0; i < setup.sonars; ++i) p.addresses.push_back("127.0.0." + std::to_string(2 + i));
  const auto folder = std::filesystem::temp_directory_path() / ("sonard_load." + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "scene.yaml") << "name: test\n";
  auto config = parse_config(yaml(setup, p.addresses), "load.yaml", folder);
  std::filesystem::remove_all(folder);
  if (!config) throw std::runtime_error(config.error().text);
  config->control.stream = {true, {config->sonars.front().bind_ip, 14770}};
  config->control.http = {true, {config->sonars.front().bind_ip, 8088}};
  LogOptions options;
  options.sink = [&p](LogLevel, const std::string& line) {
    std::lock_guard lock(p.log_mutex);
    p.log_text += line + "\n";
  };
  p.log = std::make_unique<Log>(options);
  auto scene = std::make_shared<Scene>();
  scene->name = "test";
  const auto make_engine = [](const std::shared_ptr<const Scene>&) -> std::unique_ptr<PingEngine> {
    return std::make_unique<PremadeEngine>();
  };
  p.app = std::make_unique<App>(*std::move(config), scene, make_engine, AppOptions{}, *p.log);
  if (const auto opened = p.app->open(); !opened) throw std::runtime_error(opened.error().text);
  p.thread = std::thread([&p] { p.code = p.app->run(); });
}

LoadDaemon::~LoadDaemon() { stop(); }

const std::string& LoadDaemon::address(std::size_t sonar) const { return parts_->addresses.at(sonar); }

int LoadDaemon::stop() {
  if (parts_->thread.joinable()) {
    parts_->app->request_stop();
    parts_->thread.join();
  }
  return parts_->code;
}

DeviceFigures LoadDaemon::figures(std::size_t sonar) const {
  return std::next(parts_->app->devices().begin(), static_cast<std::ptrdiff_t>(sonar))->figures();
}

std::string LoadDaemon::log_text() const {
  std::lock_guard lock(parts_->log_mutex);
  return parts_->log_text;
}

}  // namespace sonar::load
