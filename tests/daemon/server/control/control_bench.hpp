// Common parts of the loopback tests of the stream and of HTTP: a control server with a fake daemon behind it, in a thread of its
// own, and clients with deadlines.
#pragma once

#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "daemon/server/control/control_server.hpp"
#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {

/// Counts requests, keeps the last sender and pose, and answers by the kind of request. Only for the I/O thread, except where
/// marked.
class FakeOperations final : public Operations {
 public:
  void perform(const control::Operation& operation, const Sender& sender, Done done, HasLeft = {}) override {
    ++asked;
    last_sender = sender;
    if (const auto* pose = std::get_if<control::PoseSample>(&operation)) last_pose = pose->pose.position_m;
    if (std::holds_alternative<control::GetStatus>(operation)) {
      const auto status = std::make_shared<v1::DaemonStatus>();
      status->set_version("fake");
      done({.status = status});
    } else if (const auto* load = std::get_if<control::LoadScene>(&operation)) {
      if (load->path == "later") return later.push_back(std::move(done));
      if (load->path == "throw") throw std::runtime_error("no such luck");
      done({OperationResult::Code::failed, "no such scene: " + load->path});
    } else if (const auto* sonar = std::get_if<control::SetSonar>(&operation); sonar != nullptr && sonar->sonar == "unknown") {
      done({OperationResult::Code::refused, "there is no sonar \"unknown\""});
    } else {
      done({});
    }
  }
  std::string metrics() const override { return "# TYPE sonard_up gauge\nsonard_up 1\n"; }
  std::string problem() const override { return in_trouble ? "the engine hangs" : ""; }

  std::atomic<int> asked{0};            // any thread may read this
  std::atomic<bool> in_trouble{false};  // any thread may set this
  std::vector<Done> later;
  Sender last_sender;
  Vec3d last_pose{};
};

class ControlBench {
 public:
  explicit ControlBench(ControlConfig wanted = {}, LimitConfig wanted_limits = {})
      : config(std::move(wanted)), limits(wanted_limits) {
    const Ipv4 ip = *parse_ipv4(address);
    config.stream.at = config.http.at = {ip, 0};
    LogOptions options;
    options.sink = [this](LogLevel, const std::string& line) {
      std::lock_guard lock(log_mutex_);
      log_text_ += line + "\n";
    };
    log_ = std::make_unique<Log>(options);
    intake_ = std::make_unique<PoseIntake>(world, clock_, *log_, [] {});
    admission_ = std::make_unique<Admission>(limits, *log_);
    server = std::make_unique<ControlServer>(io, config, limits, *admission_, operations, events, *intake_, *log_);
    const auto opened = server->open();
    if (!opened) throw std::runtime_error(opened.error().text);
    server->start();
    thread_ = std::thread([this] { io.run(); });
  }
  ~ControlBench() { stop(); }
  /// Stops the server as App does. run() must then return; otherwise the test hangs here.
  void stop() {
    asio::post(io, [this] { server->stop(); });
    if (thread_.joinable()) thread_.join();
  }
  std::string log_text() {
    std::lock_guard lock(log_mutex_);
    return log_text_;
  }
  /// Runs `work` on the I/O thread and waits for its end.
  template <class Work>
  void on_io(Work&& work) {
    std::atomic<bool> done{false};
    asio::post(io, [&] {
      work();
      done = true;
    });
    EXPECT_TRUE(eventually([&] { return done.load(); }));
  }
  std::uint16_t stream_port() const { return server->stream().port; }
  std::uint16_t http_port() const { return server->http().port; }

  std::string address = "127.0.0.2";
  asio::io_context io{1};
  ControlConfig config;
  LimitConfig limits;
  FakeOperations operations;
  Events events;
  World world{PoseRules{}, {{"rov", {}, false}}, {}, Time{}};
  std::unique_ptr<ControlServer> server;

 private:
  const Clock clock_{false};
  std::mutex log_mutex_;
  std::string log_text_;
  std::unique_ptr<Log> log_;
  std::unique_ptr<PoseIntake> intake_;
  std::unique_ptr<Admission> admission_;
  std::thread thread_;
};

inline v1::Event ping_event(std::uint32_t number) {
  v1::Event event;
  event.mutable_ping()->set_sonar("front");
  event.mutable_ping()->set_number(number);
  return event;
}

/// A file with a token, which exists as long as this object.
struct TokenFile {
  static constexpr const char* text = "0123456789abcdef-lab";
  std::filesystem::path path = own_path("control-token");
  TokenFile() {
    std::ofstream(path) << text << "\n";
    std::filesystem::permissions(path, std::filesystem::perms::owner_read);
  }
  ~TokenFile() { std::filesystem::remove(path); }
};

}  // namespace sonar::testing_daemon
