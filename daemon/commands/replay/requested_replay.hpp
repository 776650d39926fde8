// Serves a recording of a sonar whose hosts decide which pings they get. The whole device is emulated, with its ports and
// dialogues, but its pings are the recorded ones. A request to a scanning head gets the line nearest to the direction of the
// head; other requests get one ping after another, not faster than recorded. Another thread reads the pings, so that a slow disk
// does not delay a dialogue.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/replay/read_ahead.hpp"
#include "daemon/commands/replay/replay_device.hpp"
#include "daemon/commands/replay/replay_pace.hpp"
#include "daemon/commands/replay/replay_server.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/connections/listener.hpp"
#include "daemon/server/sonars/device.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/view/recording_views.hpp"
#include "protocol/recorded/codec.hpp"

namespace sonar {

// Returns the pings of a recording for a sonar whose hosts request pings: in order or, for a mechanical scan, by direction.

struct PlayedPing {
  Time at{};
  PartsByPort parts;
};

class PlayedPings {
 public:
  static constexpr std::size_t most_scan_bytes = 512u << 20;  // limit, because a scan is kept in memory

  /// `codec` must have ping_part. `reader` and `codec` must outlive the object.
  PlayedPings(recording::RecordingReader& reader, const recording::Codec& codec) : reader_(reader), codec_(codec) {}
  /// Reads the first ping, or all lines of a scan. Errors (bad_data) name `file`: it has no ping, or a scan is too long.
  Result<void> open(const std::string& file);
  /// True for a mechanical scan, whose lines nearest() finds; next() returns the pings of all other recordings.
  bool is_scan() const { return !lines_.empty(); }

  /// Returns the next ping; nullopt at the end. Packets of different ports that follow each other are one ping.
  /// If a ping has several messages, the one with the most content is returned.
  std::optional<PlayedPing> next();
  /// True if next() has returned the last ping.
  bool at_end() const { return !ahead_; }
  void rewind();
  /// Returns the line whose direction is nearest to `head_rad`; among equally near lines, the next one after the last returned
  /// line, cyclically.
  const PlayedPing& nearest(double head_rad);

 private:
  struct Part {
    Time at{};
    recording::PingPart part;
    recording::Bytes bytes;
  };
  struct Line {
    double head_rad = 0;
    PlayedPing ping;
  };
  std::optional<Part> read();
  recording::Bytes take_richest();

  recording::RecordingReader& reader_;
  const recording::Codec& codec_;
  std::unique_ptr<recording::MessageSplitter> splitter_;  // for a make whose stream delimits messages
  std::optional<Part> ahead_;                             // the first part of the next ping
  std::vector<Line> lines_;
  std::size_t after_ = 0;  // index of the line after the last returned line
};

class RequestedReplay final : public DeviceParent {
 public:
  /// The make of `device` must have a codec with ping_part; the port in `options` is that of the make. All arguments must outlive
  /// io.run().
  RequestedReplay(asio::io_context& io, recording::RecordingReader& reader, const ReplayDevice& device, ReplayOptions options,
                  Log& log);

  /// Opens all ports. Errors name `file`: unavailable; bad_data if the recording holds no ping.
  Result<void> open(const std::string& file);
  /// Serves in io.run(), which returns after stop() or when all pings were sent (but not with `loop`, or for a scan).
  void start();
  void stop(const std::string& why = "the replay stops");

  /// `messages` counts the recorded pings that were sent; each message of a Surveyor counts as one.
  ReplayServer::Figures figures() const;
  const Result<void>& outcome() const { return outcome_; }
  /// Returns the addresses of all ports, such as "tcp 127.0.0.2:9090, udp 127.0.0.2:9090".
  std::string at() const;

  void compute(const Device& of, PingRequest request, Simulator::Done done) override;
  void on_ping_queued(const Device&, const PingQueued&) override {}
  void on_client(const Device& of, const std::string& peer, bool connected, const std::string& why) override;
  void on_stop(const Device&, const std::string&) override {}
  void on_change() override;
  void on_engine_failure(const Error& why) override;

 private:
  struct Read {
    PlayedPing ping;
    bool begins_again = false, is_last = false;
  };
  asio::awaitable<Read> read(bool from_the_front);
  asio::awaitable<PlayedPing> ping_for(const PingRequest& request);
  asio::awaitable<Simulator::Outcome> outcome_for(PingRequest request);
  void end_when_gone();

  asio::io_context& io_;
  recording::RecordingReader& reader_;
  const recording::Codec& codec_;
  PlayedPings pings_;  // after open() only `disk_` uses it, except for the lines of a scan
  ReplayOptions options_;
  Log& log_;
  Config config_;
  Clock clock_{false};
  World world_;
  Admission admission_;
  DeviceNetwork network_;
  ReplayPace pace_;
  asio::steady_timer due_;
  asio::signal_set signals_;
  Result<void> outcome_;
  std::uint64_t clients_ = 0;
  bool from_the_front_ = false, was_last_ = false, stopping_ = false, over_ = false;
  std::unique_ptr<Device> device_;
  asio::thread_pool disk_{1};  // destroyed first: its destructor waits for the current read
};

// Serves the page of `sonard replay`: the recording's pictures, with a time line for each viewer. The page does not change what
// the driver gets.

class ReplayPage final : public HttpService {
 public:
  /// The arguments must outlive the page.
  ReplayPage(asio::io_context& io, const LimitConfig& limits, Admission& admission, Log& log, PlayedRecording of);

  Result<void> open(Endpoint at) { return listener_.open(at); }
  void start() { listener_.start(); }
  void stop() { listener_.stop(); }
  Endpoint at() const { return listener_.at(); }

  asio::awaitable<HttpOutcome> answer(const HttpRequest& request, HttpConnection& from) override;
  HttpAnswer refusal(const HttpRefusal& refusal) const override;

 private:
  const LimitConfig& limits_;
  PlayedRecording of_;
  ConnectionServices services_;
  ControlConfig access_;  // the access rules of a sonard without a configuration
  ViewSecrets secrets_;
  RecordingViews views_;
  ConnectionListener<HttpConnection> listener_;
};

}  // namespace sonar
