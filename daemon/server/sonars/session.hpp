// One connection of a sonar: its socket, read and written by two coroutines, and a timer that watches for peers that stopped. The
// emulated sonar (daemon/emulator/sonar) interprets the bytes and keeps the messages that wait. Owned by its Device and by its
// own coroutines; it reports to the Device once when it is over.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "daemon/emulator/connections/connections.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/http/http_rules.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar {

/// Interface of a session or a stream of datagrams to its parent, which outlives it.
class SessionParent {
 public:
  virtual ~SessionParent() = default;
  virtual void on_bytes(ConnectionId from, protocol::BytesView bytes) = 0;
  /// The next message to write; empty when there is none.
  virtual Outbox::Message next_message(ConnectionId to) = 0;
  /// Destinations of a stream's messages.
  virtual std::vector<Endpoint> receivers(ConnectionId stream) = 0;
  virtual void on_sent(ConnectionId to, std::size_t bytes) = 0;
  /// A message has been handed to the kernel whole.
  virtual void on_written(ConnectionId to, const Outbox::Message& message) = 0;
  /// The message of a stream that was taken last had no receiver left.
  virtual void on_not_sent(ConnectionId stream) = 0;
  /// A peer that sends nothing for longer is disconnected. nullopt: no limit.
  virtual std::optional<std::chrono::milliseconds> longest_silence(ConnectionId of) const = 0;
  /// The host of a stream has been silent for half of that or longer: it may be asked for a sign.
  virtual void look_for_host(ConnectionId stream) = 0;
  /// It ends after the message being written.
  virtual void on_finish(ConnectionId session) = 0;
  /// An exception ended one of its coroutines; on_over follows.
  virtual void on_fault(const std::string& what) = 0;
  /// A datagram could not be sent.
  virtual void on_send_error(const Endpoint& to, const std::string& why) = 0;
  /// `by_client`: it left; the daemon did not end the connection.
  virtual void on_over(ConnectionId session, const std::string& why, bool by_client) = 0;
};

class Session : public std::enable_shared_from_this<Session> {
 public:
  struct Setup {
    ConnectionId id = 0;
    bool digest = false;                // SHA-256 of what is sent
    LimitConfig limits;                 // limits for one client
    std::shared_ptr<const void> place;  // kept as long as the session lives
  };
  /// Longest time a client may take for its last message after finish(); then it is reset. One whose computer has all of it, and
  /// our FIN, is not waited for longer than `fin_limit`.
  static constexpr std::chrono::milliseconds finish_limit{800}, fin_limit{400};
  /// After an end of the stream by a fault: a client that ignores it has time to show that.
  static constexpr std::chrono::milliseconds fault_fin_limit{1500};

  Session(SessionParent& parent, tcp::socket socket, const Setup& setup);

  void start();
  /// There is something to write.
  void wake();
  /// No more messages after the one being written, without its pauses; then FIN. Reset if the client does not take it in time.
  void finish(std::string why);
  /// At once, without FIN.
  void reset(std::string why);
  /// Off: what the client sends is left to the kernels, until they are full.
  /// The rest of the message that is being written comes without pauses.
  void end_pauses();
  void read_from_client(bool on);
  /// When the peer has hung up and every byte from it has been read: over.
  void end_if_closed();

  ConnectionId id() const { return setup_.id; }
  const Sha256& digest() const { return digest_; }
  std::chrono::steady_clock::duration connected_for() const { return Steady::now() - connected_at_; }
  /// How long no byte of the message being written has gone out; 0 when none is written, and in a pause that a fault makes.
  std::chrono::steady_clock::duration stands_for() const;
  /// Number of the ping being written; 0 = none.
  std::uint32_t writes_ping() const { return writing_ ? ping_ : 0; }
  /// With the kernel, not yet confirmed by the client's.
  int unconfirmed_bytes();

 private:
  using Steady = std::chrono::steady_clock;

  asio::awaitable<void> read();
  asio::awaitable<void> rest(Steady::time_point until);
  asio::awaitable<void> write();
  asio::awaitable<void> watch();
  asio::awaitable<bool> write_whole(const Outbox::Message& message);
  asio::awaitable<bool> write_bytes(protocol::BytesView bytes);
  asio::awaitable<bool> write_shaped(protocol::BytesView bytes, const Outbox::Shape& shape);
  asio::awaitable<bool> pause_writing(std::chrono::nanoseconds length);
  asio::awaitable<bool> deliver();
  void end_by(Outbox::Shape::End end);
  Steady::time_point watch_until() const;
  bool is_silent(Steady::time_point now) const;
  bool has_all(Steady::time_point now);
  void send_fin();
  void over(std::string why, bool by_client = false);
  void over_after(const error_code& ec);
  void spawn(asio::awaitable<void> (Session::*part)());

  SessionParent& parent_;
  tcp::socket socket_;
  Setup setup_;
  Sha256 digest_;
  InputRate input_rate_;
  asio::steady_timer wake_reader_, wake_writer_, wake_watch_, pause_;
  std::array<std::byte, 8192> received_{};
  HttpDetector http_;
  const Steady::time_point connected_at_ = Steady::now();
  Steady::time_point received_at_ = connected_at_;  // a byte came in
  Steady::time_point progress_at_{};                // a byte went out, while writing; in a pause its end
  Steady::time_point finish_by_{}, fin_at_{};
  std::uint32_t ping_ = 0;  // number of the ping that is or was written last; 0 = a reply
  bool reading_ = true, writing_ = false, hurries_ = false, finishing_ = false, sent_fin_ = false, over_ = false;
  bool fin_by_fault_ = false;
  std::string why_;
};

/// Name and address of the other end, for the log and the status message.
Peer peer_of(const tcp::socket& socket);

}  // namespace sonar
