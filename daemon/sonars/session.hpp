// One connected client: its socket, its conversation and its outbox. Two coroutines read and write, a timer keeps watch.
// Owned by its Device's list and by its own coroutines; it tells the Device once when it is over.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "core/sonar/ping.hpp"
#include "daemon/config/config.hpp"
#include "daemon/sonars/input_rate.hpp"
#include "daemon/sonars/outbox.hpp"
#include "daemon/system/asio.hpp"
#include "daemon/system/sha256.hpp"
#include "daemon/time/clock.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

class Session;

/// What a session needs from its parent, which outlives it.
class SessionParent {
 public:
  virtual ~SessionParent() = default;
  /// Settings, triggers and stored addresses; replies, notices and Close are the session's own business.
  virtual void on_event(Session& from, const protocol::Event& event) = 0;
  /// A message has been handed to the kernel whole.
  virtual void on_written(Session& by, const Outbox::Message& message) = 0;
  /// An exception ended one of its coroutines; on_over follows.
  virtual void on_fault(Session& session, const std::string& what) = 0;
  virtual void on_over(Session& session, const std::string& why) = 0;
};

class Session : public std::enable_shared_from_this<Session> {
 public:
  struct Setup {
    OutboxRules outbox;
    bool digest = false;
    std::uint64_t number = 0;           // of the client, counted per sonar from 1
    LimitConfig limits;                 // what it may cost us
    std::shared_ptr<const void> place;  // kept as long as the session lives
  };
  /// Longest time a client may take for its last message after finish(); then it is reset.
  static constexpr std::chrono::milliseconds finish_limit{1500};

  Session(SessionParent& parent, const Clock& clock, tcp::socket socket, std::unique_ptr<protocol::Dialogue> dialogue,
          const Setup& setup);

  void start();
  /// Offers a ping, made with the settings of that request. Returns what the client wants next, for the device.
  std::vector<protocol::Event> push_ping(const std::shared_ptr<const protocol::Bytes>& bytes, const PingRequest& ping,
                                         protocol::BytesView made_with, Time now);
  /// What is due at `now`, of the time lived through: keep-alives, what a host has subscribed to.
  void tick(Time now);
  // Stepped time, which passes from one to the next, of the time lived through. Nothing when the conversation is ending.
  /// When tick() has something to do next.
  std::optional<Time> next_tick() const;
  /// When it will ask for a ping by itself.
  std::optional<Time> next_wish() const;
  /// No more messages after the one being written; then FIN. Reset if the client does not take it in time.
  void finish(std::string why);
  /// At once, without goodbye.
  void reset(std::string why);

  bool idle() const { return outbox_.idle(); }
  const Outbox& outbox() const { return outbox_; }
  const Sha256& digest() const { return digest_; }
  std::uint64_t number() const { return setup_.number; }
  std::uint64_t bytes_written() const { return bytes_written_; }
  std::uint64_t bytes_read() const { return bytes_read_; }
  std::chrono::steady_clock::duration connected_for() const { return Steady::now() - connected_at_; }
  protocol::Ipv4 client_ip() const;
  std::string client() const { return client_; }  // "127.0.0.1:40123"

 private:
  using Steady = std::chrono::steady_clock;

  asio::awaitable<void> read();
  asio::awaitable<void> rest(Steady::duration pause);
  asio::awaitable<void> write();
  asio::awaitable<void> watch();
  asio::awaitable<bool> write_whole(const Outbox::Message& message);
  asio::awaitable<bool> write_bytes(protocol::BytesView bytes);
  void handle(protocol::Reaction reaction);
  Steady::time_point watch_until() const;
  bool is_silent(Steady::time_point now) const;
  void over(std::string why);
  void spawn(asio::awaitable<void> (Session::*part)());

  SessionParent& parent_;
  const Clock& clock_;
  tcp::socket socket_;
  tcp::endpoint peer_;
  std::string client_;
  std::unique_ptr<protocol::Dialogue> dialogue_;
  Setup setup_;
  Outbox outbox_;
  Sha256 digest_;
  InputRate input_rate_;
  asio::steady_timer wake_reader_, wake_writer_, wake_watch_;
  std::array<std::byte, 8192> received_{};
  const Steady::time_point connected_at_ = Steady::now();
  std::uint64_t bytes_written_ = 0, bytes_read_ = 0;
  Steady::time_point heard_at_ = connected_at_;  // a byte came in
  Time not_before_{};                            // that the dialogue is ticked again
  Steady::time_point progress_at_{};             // a byte went out, while writing
  Steady::time_point finish_by_{};
  bool writing_ = false, finishing_ = false, said_goodbye_ = false, over_ = false;
  std::string why_;
};

}  // namespace sonar
