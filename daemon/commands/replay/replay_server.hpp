// Serves a recording as the recorded sonar would. It sends status datagrams and, to one client at a time, the messages byte for
// byte over TCP. If the device has dialogues, it answers the host, and pings begin when the host requests them. An ARIS sends
// datagrams to the receivers that its controller sets. A Sonar 3D-15 sends datagrams to the receivers that were set over HTTP, as
// if one client stayed connected. The server uses no scene and no engine. RequestedReplay serves the sonars whose hosts select
// the pings.
#pragma once

#include <functional>
#include <memory>

#include "daemon/commands/replay/read_ahead.hpp"
#include "daemon/commands/replay/replay_device.hpp"
#include "daemon/commands/replay/replay_pace.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/sonars/sonar_http.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

struct ReplayOptions {
  Endpoint at{{127, 0, 0, 2}, 0};   // port 0: any free port
  std::vector<Endpoint> status_to;  // empty = the broadcast address of the network of `at`, at the device's port
  double speed = 1;                 // multiple of the recorded pace
  bool stepped = false;             // true: sends a message as soon as the client has read the previous one
  bool loop = false;                // repeats the recording
  double rate_hz = 10;              // messages per second of recordings without times
  std::chrono::milliseconds stall = LimitConfig{}.stall;  // a client that reads no byte for this time is reset
  bool handle_signals = false;
  std::function<void()> on_end = {};  // called when the server has no more work on io
};

class ReplayServer {
 public:
  struct Figures {
    std::uint64_t clients = 0, refused = 0, messages = 0, bytes = 0, times_through = 0, client_bytes = 0;
    std::uint64_t greedy = 0;   // clients that were closed because they read no answers
    std::uint64_t stalled = 0;  // clients that were reset because they read nothing
  };

  /// `reader` must be at its start; another thread uses it until io.run() has returned. All arguments must outlive the server.
  ReplayServer(asio::io_context& io, recording::RecordingReader& reader, ReplayDevice device, ReplayOptions options, Log& log);

  /// Opens the port. Error: unavailable.
  Result<void> open();
  /// Serves the recording in io.run(), which returns at the end of the recording (not with loop) or after stop().
  void start();
  /// Completes the present message and ends the stream. Resets a connection whose client has not received it after 1.5 s.
  void stop();

  const Figures& figures() const { return figures_; }
  /// Call it after io.run(). The error is `bug` if an exception ended the replay.
  const Result<void>& outcome() const { return outcome_; }
  Endpoint at() const { return at_; }

 private:
  using Steady = std::chrono::steady_clock;
  struct Client {
    Client(tcp::socket s, const LimitConfig& limits)
        : socket(std::move(s)), wake(socket.get_executor()), stall(socket.get_executor()), input(limits.input_bytes_per_s) {}
    tcp::socket socket;
    asio::steady_timer wake;  // cancelled when the client leaves
    asio::steady_timer stall;
    Ipv4 ip{};
    std::string name;
    bool gone = false;
    InputRate input;
    // The members below are for a device with dialogues.
    std::unique_ptr<protocol::Dialogue> dialogue;
    protocol::Bytes replies;  // replies that are not sent yet
    std::vector<udp::endpoint> receivers;
    bool wants_frames = false;
    std::int64_t frames = 0;
    Steady::time_point heard = Steady::now();
  };
  using ClientPointer = std::shared_ptr<Client>;
  enum class Played { to_the_end, left, stopped };

  asio::awaitable<void> accept();
  asio::awaitable<void> serve(ClientPointer client);
  asio::awaitable<Played> play(ClientPointer client, ReplayPace& pace);
  bool ends(const Client& client) const { return stopping_ || client.gone; }
  bool number_datagram(const Client& client, protocol::Bytes& datagram) const;
  asio::awaitable<bool> write(ClientPointer client, protocol::BytesView bytes);
  void watch_stall(const ClientPointer& client);
  asio::awaitable<void> send_replies(ClientPointer client);
  asio::awaitable<void> send_datagram(ClientPointer client, const protocol::Bytes& datagram);
  asio::awaitable<void> listen_to(ClientPointer client);
  void on_client_bytes(Client& client, protocol::BytesView bytes);
  void apply(Client& client, const protocol::Event& event);
  Result<void> open_http();
  void end_if_silent();
  asio::awaitable<void> close_stream(ClientPointer client);
  asio::awaitable<void> send_status();
  asio::awaitable<void> watch_signals();
  void spawn(auto coroutine);
  void end();

  asio::io_context& io_;
  ReadAhead reader_;
  ReplayDevice device_;
  ReplayOptions options_;
  Log& log_;
  Endpoint at_;
  SonarConfig network_;  // mask and broadcast address, as those of a configured sonar
  std::vector<udp::endpoint> status_to_;
  tcp::acceptor acceptor_;
  udp::socket status_;
  asio::steady_timer status_timer_, deadline_;
  asio::signal_set signals_;
  LimitConfig limits_;
  Admission admission_{limits_, log_};
  std::unique_ptr<SonarHttp> http_;  // for a device with settings over HTTP; such a device has no other listener
  ClientPointer client_;
  LogLimiter refused_limit_, unsent_limit_, notice_limit_;
  Figures figures_;
  Result<void> outcome_;
  bool stopping_ = false, over_ = false, damage_logged_ = false;
};

}  // namespace sonar
