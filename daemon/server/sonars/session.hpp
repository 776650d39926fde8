// One connection of a sonar: a socket, two coroutines that read and write it, and a third that detects unresponsive peers. The
// emulated sonar (daemon/emulator/sonar) interprets the bytes and has the outbox. The Device and the coroutines own the session,
// which reports its end once to the Device.
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
#include "daemon/server/http/http_router.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar {

/// The parent of a session or a stream of datagrams. It must outlive them.
class SessionParent {
 public:
  virtual ~SessionParent() = default;
  /// Handles received bytes. Returns the additional work that they caused (connections/input_rate.hpp).
  virtual std::size_t on_bytes(ConnectionId from, protocol::BytesView bytes) = 0;
  /// Returns the next message to write; empty if there is none.
  virtual Outbox::Message next_message(ConnectionId to) = 0;
  /// Returns the destinations of the messages of a stream.
  virtual std::vector<Endpoint> receivers(ConnectionId stream) = 0;
  virtual void on_sent(ConnectionId to, std::size_t bytes) = 0;
  /// Reports that the kernel has the whole message.
  virtual void on_written(ConnectionId to, const Outbox::Message& message) = 0;
  /// Reports that the last message of a stream had no receiver.
  virtual void on_not_sent(ConnectionId stream) = 0;
  /// Returns the silence after which a peer is disconnected; nullopt = no limit.
  virtual std::optional<std::chrono::milliseconds> longest_silence(ConnectionId of) const = 0;
  /// Called when the host of a stream has been silent for half of longest_silence(), so that the parent can check whether the
  /// host is alive.
  virtual void look_for_host(ConnectionId stream) = 0;
  /// Reports that the session will end after the current message and waiting replies.
  virtual void on_finish(ConnectionId session) = 0;
  /// Reports that an exception ended a coroutine; on_over follows.
  virtual void on_fault(const std::string& what) = 0;
  /// Reports that a datagram could not be sent.
  virtual void on_send_error(const Endpoint& to, const std::string& why) = 0;
  /// Reports the end. `by_client`: the client closed the connection.
  virtual void on_over(ConnectionId session, const std::string& why, bool by_client) = 0;
};

class Session : public std::enable_shared_from_this<Session> {
 public:
  struct Setup {
    ConnectionId id = 0;
    bool digest = false;                // true: computes the SHA-256 of the sent bytes
    LimitConfig limits;                 // limits for one client
    std::shared_ptr<const void> place;  // slot of the session
  };
  /// After finish(), a client that does not receive its last message within `finish_limit` is reset. Once the client's computer
  /// has acknowledged everything, the limit for the client's FIN is `fin_limit`.
  static constexpr std::chrono::milliseconds finish_limit{800}, fin_limit{400};
  /// Work that a new client may cause at once. A larger value would reward repeated connecting.
  static constexpr std::size_t at_once = 4096;
  /// Replaces fin_limit after a fault has ended the stream; longer, so that a client that ignores the end can be observed.
  static constexpr std::chrono::milliseconds fault_fin_limit{1500};

  Session(SessionParent& parent, tcp::socket socket, const Setup& setup);

  void start();
  /// Call it when there is a message to write.
  void wake();
  /// Sends the current message without pauses, waiting replies, and FIN. Resets a client that does not receive them in time.
  void finish(std::string why);
  /// Ends the connection at once with RST.
  void reset(std::string why);
  /// Writes the rest of the current message without pauses.
  void end_pauses();
  /// Starts or stops reading. With `on` false the client's bytes stay in the buffers of the kernels.
  void read_from_client(bool on);
  /// Ends the session if the peer has closed and every byte from it has been read.
  void end_if_closed();

  ConnectionId id() const { return setup_.id; }
  const Sha256& digest() const { return digest_; }
  std::chrono::steady_clock::duration connected_for() const { return Steady::now() - connected_at_; }
  /// Returns the time since the last sent byte of the current message; 0 if none is being written, or during a pause of a fault.
  std::chrono::steady_clock::duration stands_for() const;
  /// Returns the number of the ping that is being written; 0 = none.
  std::uint32_t writes_ping() const { return writing_ ? ping_ : 0; }
  /// Returns the number of bytes in the kernel that the client's computer has not acknowledged.
  int unconfirmed_bytes();

 private:
  using Steady = std::chrono::steady_clock;

  asio::awaitable<void> read();
  asio::awaitable<void> pass_on(protocol::BytesView bytes);
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
  Steady::time_point received_at_ = connected_at_;  // time of the last received byte
  Steady::time_point progress_at_{};  // time of the last sent byte of the current message, or the end of the present pause
  Steady::time_point finish_by_{}, fin_at_{};
  std::uint32_t ping_ = 0;  // number of the current or last ping; 0 = a reply
  bool reading_ = true, writing_ = false, hurries_ = false, finishing_ = false, sent_fin_ = false, over_ = false;
  bool fin_by_fault_ = false;
  std::string why_;
};

/// Returns name and address of the other end, for the log and the status message.
Peer peer_of(const tcp::socket& socket);

}  // namespace sonar
