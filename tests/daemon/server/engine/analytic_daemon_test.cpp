// The whole daemon with the real CPU engine over analytic shapes in place of Embree, so that the thread sanitizer checks all of
// its code. Pings are sent while control requests status, adds and moves objects, and while the configuration is read again.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <fstream>

#include "core/base/parallel.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/scene/ray_scene.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Returns a wall 0.2 m thick, perpendicular to the sonar's axis, and a ball behind the sonar.
ScenePointer wall_at(double x_m) {
  auto scene = parse_scene(
      "objects:\n  - {name: wall, type: box, material: concrete, size_m: [0.2, 2, 2], pose: {xyz_m: [" + std::to_string(x_m) +
          ", 0, -3]}}\n"
          "  - {name: ball, type: sphere, material: steel, radius_m: 0.1, moving: true, pose: {xyz_m: [-3, 0, -3]}}\n",
      "analytic", {});
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}

/// Returns the same scene below a water surface; only the height of the surface matters here.
ScenePointer wall_below_the_surface() {
  Scene scene = *wall_at(1.8);
  scene.sea_surface.present = true;
  return std::make_shared<const Scene>(std::move(scene));
}

/// The daemon as main.cpp composes it, in a thread; the destructor stops it.
class RealDaemon {
 public:
  explicit RealDaemon(ScenePointer scene = wall_at(1.8)) {
    setup_.more = "control: {stream: off, http: '" + address() + ":8088'}\n";
    std::ofstream(::testing::TempDir() + "/scene.yaml") << "name: test\n";
    std::ofstream(file_) << yaml_of(setup_);
    AppOptions options;
    options.handle_signals = true;
    options.read_config = [file = file_] { return load_config(file); };
    options.load_scene = [](const SceneFile&) -> Result<ScenePointer> { return wall_at(1.5); };
    LogOptions log;
    log.sink = [this](LogLevel, const std::string& line) {
      std::lock_guard lock(log_mutex_);
      log_text_ += line + "\n";
    };
    log_ = std::make_unique<Log>(log);
    auto config = load_config(file_);
    if (!config) throw std::runtime_error(config.error().text);
    app_ = std::make_unique<App>(
        *std::move(config), std::move(scene), [this](ScenePointer s) { return make_cpu_engine(std::move(s), pool_); }, options,
        *log_);
    if (const auto opened = app_->open(); !opened) throw std::runtime_error(opened.error().text);
    thread_ = std::thread([this] { code_ = app_->run(); });
  }
  ~RealDaemon() { stop(); }

  const std::string& address() const { return setup_.address; }
  const App& app() const { return *app_; }
  int stop() {
    app_->request_stop();
    if (thread_.joinable()) thread_.join();
    return code_;
  }
  std::string log_text() {
    std::lock_guard lock(log_mutex_);
    return log_text_;
  }
  /// Returns head and body of the answer, over a separate connection.
  std::string http(const std::string& method, const std::string& target, const std::string& body = {}) {
    Client client(address(), 8088);
    client.send(method + " " + target + " HTTP/1.1\r\nHost: " + address() + ":8088\r\nConnection: close\r\n" +
                "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    std::string answer;
    for (const std::byte b : client.read_raw(std::size_t{1} << 24)) answer += static_cast<char>(b);
    return answer;
  }

 private:
  DaemonSetup setup_;
  std::string file_ = ::testing::TempDir() + "/" + setup_.address + "-analytic.yaml";
  Parallel pool_{2};  // must outlive the engines in App
  std::mutex log_mutex_;
  std::string log_text_;
  std::unique_ptr<Log> log_;
  std::unique_ptr<App> app_;
  std::thread thread_;
  int code_ = -1;
};

/// Returns the range of the strongest row of the middle beam.
double nearest_m(const oculus::DecodedPing& ping) {
  std::size_t loudest = 0;
  for (std::size_t row = 0; row < ping.rows(); ++row)
    if (ping.sample(row, ping.beams() / 2) > ping.sample(loudest, ping.beams() / 2)) loudest = row;
  return ping.row_range_m(loudest);
}

/// Reads pings until one shows the wall at that range.
::testing::AssertionResult sees_wall(Client& client, double range_m) {
  double last_m = 0;
  for (int i = 0; i < 60; ++i) {
    const auto ping = client.next_ping();
    if (!ping) return ::testing::AssertionFailure() << "pings have ended";
    if (!ping->violations.empty()) return ::testing::AssertionFailure() << ping->violations[0];
    last_m = nearest_m(*ping);
    if (std::abs(last_m - range_m) < 0.08) return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure() << "the wall stands at " << last_m << " m, not at " << range_m;
}

TEST(AnalyticDaemon, PingsWhileControlChangesTheSceneAndTheConfigurationIsReadAgain) {
  ASSERT_EQ(RayScene::version(), "analytic rays") << "the program is linked with another tracer";
  RealDaemon daemon;
  Client client(daemon.address());
  client.fire(fire_at(oculus::PingRate::hz40));
  EXPECT_TRUE(sees_wall(client, 1.7));

  EXPECT_THAT(daemon.http("GET", "/api/v1/status"), HasSubstr("\"wall\""));
  EXPECT_THAT(daemon.http("POST", "/api/v1/add_object",
                          R"({"name": "post", "like": "wall", "at": {"frame": "ENU_FLU",
                              "position": {"x": 0.8, "z": -3}, "orientation": {"w": 1}}})"),
              HasSubstr("\"OK\""));
  EXPECT_TRUE(sees_wall(client, 0.7));
  EXPECT_THAT(daemon.http("POST", "/api/v1/set_object",
                          R"({"object": "post", "at": {"frame": "ENU_FLU",
                              "position": {"x": 1.2, "z": -3}, "orientation": {"w": 1}}})"),
              HasSubstr("\"OK\""));
  EXPECT_THAT(daemon.http("GET", "/metrics"), HasSubstr("sonard_pings_total{sonar=\"front\"} "));
  EXPECT_TRUE(sees_wall(client, 1.1));

  ASSERT_EQ(kill(getpid(), SIGHUP), 0);
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("reloaded: front untouched") != std::string::npos; }))
      << daemon.log_text();
  EXPECT_TRUE(sees_wall(client, 1.4)) << "the scene of the file has no objects of control";

  EXPECT_EQ(daemon.stop(), 0) << daemon.log_text();
  const DeviceFigures f = daemon.app().devices().front().figures();
  EXPECT_LE(f.pings + f.skipped_ticks, f.ticks);
  EXPECT_LE(f.ticks, f.pings + f.skipped_ticks + 1) << "a ping may be under way at the stop";
  EXPECT_EQ(f.offered, f.sent + f.dropped);
}

TEST(AnalyticDaemon, LogsOnceThatASonarIsAboveTheSeaSurface) {
  RealDaemon daemon(wall_below_the_surface());
  Client client(daemon.address());
  client.fire(fire_at(oculus::PingRate::hz40));
  EXPECT_TRUE(sees_wall(client, 1.7));
  EXPECT_THAT(daemon.log_text(), Not(HasSubstr("above the sea surface")));
  const auto raise_to = [&](double z_m) {
    const std::string body = R"({"frame": "ENU_FLU", "orientation": {"w": 1}, "position": {"z": )" + std::to_string(z_m) + "}}";
    return daemon.http("POST", "/api/v1/pose", body);
  };
  EXPECT_THAT(raise_to(0.4), HasSubstr("\"OK\""));
  EXPECT_TRUE(
      eventually([&] { return daemon.log_text().find("above the sea surface and receives noise only") != std::string::npos; }));
  EXPECT_TRUE(client.next_ping()) << "pings continue";
  EXPECT_THAT(raise_to(-3), HasSubstr("\"OK\""));
  EXPECT_TRUE(sees_wall(client, 1.7));
  EXPECT_THAT(raise_to(0.4), HasSubstr("\"OK\""));
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(client.next_ping());
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_GT(daemon.app().devices().front().figures().out_of_water, 0u);
  const std::string log = daemon.log_text();
  const auto first = log.find("above the sea surface");
  EXPECT_EQ(log.find("above the sea surface", first + 1), std::string::npos) << "the line must not be repeated with the waves\n"
                                                                             << log;
  EXPECT_THAT(log, HasSubstr("z_m=0.4"));
}

}  // namespace
}  // namespace sonar::testing_daemon
