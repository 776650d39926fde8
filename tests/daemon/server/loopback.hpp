// Common parts of the daemon's loopback tests: a daemon with a fake engine in a thread, and a driver-side client with deadlines.
// Test programs that use these parts link own_network, because the ports are those of the products.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/config/load_config.hpp"
#include "daemon/server/app.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::testing_daemon {

using Steady = std::chrono::steady_clock;
using std::chrono::milliseconds;
constexpr milliseconds patience{20000};  // time limit of every expected event

/// Returns a path in the folder for temporary files that no other test uses, in this process or another one.
std::string own_path(const std::string& name);

/// An engine without physics: each sample is a pattern of ping number, row and beam. It stores its requests.
class FakeEngine final : public PingEngine {
 public:
  struct Record {
    std::mutex mutex;
    std::vector<PingRequest> requests;
    std::vector<ScenePointer> scenes;  // the scene of each ping
    std::vector<PingRequest> all() {
      std::lock_guard lock(mutex);
      return requests;
    }
  };
  /// `before` is called with the number of each ping and may throw.
  using Before = std::function<void(std::uint32_t)>;
  FakeEngine(std::shared_ptr<Record> record, milliseconds takes, Before before = {}, ScenePointer scene = {})
      : record_(std::move(record)), takes_(takes), before_(std::move(before)), scene_(std::move(scene)) {}
  std::vector<Ping> run(std::span<const PingRequest> requests) override;
  std::string description() const override { return "fake"; }
  static std::uint8_t sample(std::uint32_t ping, std::size_t row, std::size_t beam);

 private:
  static std::vector<std::byte> samples(std::uint32_t ping, std::size_t rows, std::size_t beams, std::size_t sample_bytes);
  std::shared_ptr<Record> record_;
  milliseconds takes_;
  Before before_;
  ScenePointer scene_;
};

/// Blocks the engine until the test allows a ping, so that the daemon is never ahead of a client that reads slowly. Ticks that
/// pass meanwhile are skipped; numbers of pings do not count them.
class PingGate {
 public:
  void allow(int pings = 1);
  /// From now on allows every ping.
  void open();
  /// The engine calls this before each ping; it blocks until the ping is allowed.
  void pass();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int allowed_ = 0;
  bool open_ = false;
};

/// Returns a mesh of a few triangles.
std::shared_ptr<const Mesh> small_mesh();
/// Returns a scene of the objects "floor" and "box" (materials "mud" and "steel"), with `moving_object` also "crate", which
/// moves.
std::shared_ptr<Scene> small_scene(bool moving_object = false);

struct DaemonSetup {
  std::string address = "127.0.0.2";
  std::string profile = "oculus-m1200d";
  std::string sonar_lines;    // further keys of the sonar, "    key: value\n"
  std::string vehicle_lines;  // vehicles in addition to rov, "  - {name: boat}\n"
  std::string more;           // further sections
  AppOptions options;
  milliseconds engine_takes{0};
  FakeEngine::Before engine_before;
  std::shared_ptr<PingGate> gate;  // null: each ping is made when it is due. stop() opens the gate
  bool moving_object = false;
  ScenePointer scene;                               // if set, used instead of small_scene()
  std::function<void(const Scene&)> before_engine;  // called on the thread that makes an engine for a later scene
  bool config_file = false;                         // the configuration is in a file and can be read again
  std::function<void(Config&)> edit_config;         // called before the daemon starts
};
/// Returns the configuration with which Daemon starts.
std::string yaml_of(const DaemonSetup& setup);

class Daemon {
 public:
  explicit Daemon(DaemonSetup setup = {});
  ~Daemon();
  /// Stops the daemon if it is still running, and returns run()'s result.
  int stop();
  /// Waits until the daemon ends by itself.
  int wait();
  App& app() { return *app_; }
  const std::string& address() const { return address_; }
  std::vector<PingRequest> requests() { return record_->all(); }
  /// Returns the scene of each of requests().
  std::vector<ScenePointer> scenes();
  /// Performs an operation on the I/O thread and waits for its answer.
  OperationResult ask(const control::Operation& operation);
  std::future<OperationResult> ask_later(const control::Operation& operation);
  v1::DaemonStatus status();
  /// Runs `work` on the I/O thread and waits for its end.
  void on_io_thread(const std::function<void()>& work);
  /// Writes the configuration file (setup.config_file), which the next reload reads.
  void write_config(const std::string& yaml) const;
  std::string log_text();
  /// Returns the figures of the first sonar. Call it only after stop() or wait().
  DeviceFigures figures() const { return app_->devices().front().figures(); }

 private:
  std::string address_, config_path_;
  std::shared_ptr<PingGate> gate_;
  std::shared_ptr<FakeEngine::Record> record_ = std::make_shared<FakeEngine::Record>();
  std::mutex log_mutex_;
  std::string log_text_;
  std::unique_ptr<Log> log_;
  std::unique_ptr<App> app_;
  std::thread thread_;
  std::optional<int> code_;
};

/// A plain TCP client that decodes the bytes that it reads. All its waits have a deadline.
class Client {
 public:
  /// `receive_buffer`: a small one makes a client stall sooner.
  explicit Client(const std::string& address, std::uint16_t port = 52100, int receive_buffer = 0);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(const std::vector<std::byte>& bytes);
  void send(const std::string& text);
  void fire(const oculus::FireRequest& fire) { send(oculus::make_fire(fire)); }
  /// Returns the next message; nullopt at the deadline or the end of the stream.
  std::optional<oculus::Received> next(milliseconds timeout = patience);
  /// Returns the next ping and skips other messages.
  std::optional<oculus::DecodedPing> next_ping(milliseconds timeout = patience);
  /// Reads to the end of the stream; true = FIN, false = reset or deadline. Bytes are decoded after the end: a daemon that stops
  /// gives a client less than a second to receive its last message, and decoding may take longer on a busy machine.
  bool read_to_end(milliseconds timeout = patience);
  std::vector<std::byte> read_raw(std::size_t at_least, milliseconds timeout = patience);
  void reset();           // closes the connection with an RST
  void finish_sending();  // sends a FIN, but continues to read
  /// From now on the client is like a computer without power: not even its kernel receives or acknowledges.
  void die();
  void close();

  std::uint64_t bytes_read = 0;
  bool ended = false, was_reset = false;
  oculus::Decoder decoder;
  std::optional<Sha256> digest;  // digest of all read bytes, if a test sets one; it is slow without optimisation

 private:
  bool read_some(milliseconds timeout, std::vector<std::byte>* raw = nullptr);
  int fd_ = -1;
};

/// Returns a fire message with a driver's defaults (mode 2, metres, 8 bit, 256 beams) and this rate and range.
oculus::FireRequest fire_at(oculus::PingRate rate, double range_m = 2);

void send_udp(const std::string& address, std::uint16_t port, const std::vector<std::byte>& bytes);
std::vector<std::byte> bytes_of(const std::string& text);

/// Polls until `done` returns true, or the deadline. Returns whether it has returned true.
template <class Done>
bool eventually(Done&& done, milliseconds timeout = patience) {
  const auto deadline = Steady::now() + timeout;
  while (!done()) {
    if (Steady::now() > deadline) return false;
    std::this_thread::sleep_for(milliseconds(5));
  }
  return true;
}

}  // namespace sonar::testing_daemon
