// Runs the host of a make over blocking sockets to get the pings of a device. It also reads pings of recordings, and finds
// devices by their status datagrams.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/elapsed.hpp"
#include "clients/sonarctl/net.hpp"
#include "core/base/result.hpp"
#include "protocol/host.hpp"
#include "protocol/recording/pcap/pcap.hpp"

namespace sonar::clients {

using protocol::find_make;
using protocol::HostPing;
using protocol::Make;
using protocol::PingFacts;
using protocol::Wanted;

/// The make that usually uses this port, or null.
const Make* make_at(std::uint16_t port);

/// A sonar that accepted a connection, and closed it before it answered.
struct Rejection {
  const Make* make = nullptr;
  Endpoint at;
};

class PingStream {
 public:
  /// Connects and opens the conversation. `make`: null = the first make that answers at its usual port. `patience`: for the
  /// connection and for answers. Errors: usage (settings that the sonar does not have), io (closed), unavailable (no answer),
  /// bad_data (another service). `keeps_messages`: fills Item::messages. `rejection`: set if the sonar closed the connection
  /// before it answered.
  static Result<PingStream> open(const Endpoint& device, const Make* make, const Wanted& wanted,
                                 std::chrono::milliseconds patience, bool keeps_messages = false, Rejection* rejection = nullptr);
  PingStream(PingStream&&) = default;
  /// Puts back the settings, and waits for the sonar to answer and to close the connection.
  ~PingStream();
  /// Shortens the waits of the destructor, because the sonar has probably gone.
  void count_as_lost() { is_lost_ = true; }

  struct Item {
    Wait what = Wait::timed_out;
    std::optional<HostPing> ping;      // set only with Wait::data; unset then: another message
    std::vector<std::string> notices;  // notices of the host
    /// All messages sent and received since the previous item, if they are kept.
    std::vector<recording::RecordedMessage> messages = {};
    std::string error;
    ErrorKind kind = ErrorKind::io;  // kind of the error
    bool is_not_recorded = false;    // true: the error is about the file of record_to(), not about the connection
    bool is_from_host = false;       // true: the error is a whole sentence about what the sonar has sent
  };
  /// Returns the next ping or message, or what happened instead within `patience`. Requests a ping if the make requires that.
  Item next(std::chrono::milliseconds patience);
  /// Waits at most `patience` for the first byte. Returns true if the sonar closes the connection before this byte.
  bool is_rejected(std::chrono::milliseconds patience) const;
  /// Also writes every byte received over TCP to this file. Error usage: the sonar does not send its pings over TCP.
  Result<void> record_to(const std::filesystem::path& file);

  /// Returns the time by the clock of Item::messages.
  Time unix_now() const { return unix_time_.now(); }
  const protocol::Host& host() const { return *host_; }
  const Make& make() const { return *make_; }
  const Endpoint& device() const { return device_; }
  /// Returns the addresses and ports of the connection and the datagrams, for the headers of a capture.
  recording::PcapConversation conversation() const;
  /// Returns our address at the first port, such as "127.0.0.1:41022"; empty for HTTP.
  std::string own() const;
  /// Returns "127.0.0.2:14750, a BlueView P900-90, serial 7001".
  std::string about() const { return text_from(device_) + ", " + host_->about(); }

 private:
  PingStream(const Make& make, Endpoint device, std::unique_ptr<protocol::Host> host, bool keeps_messages)
      : make_(&make), device_(std::move(device)), host_(std::move(host)), keeps_(keeps_messages) {
    if (!keeps_ || make.codec.framing == nullptr) return;
    using Kind = protocol::HostPort::Kind;
    for (std::size_t port = 0; port < make.ports.size(); ++port)
      if (port == 0 || (make.ports.front().kind == Kind::tcp && make.ports[port].kind == Kind::tcp))
        splitters_.try_emplace(port, recording::Origin::device, *make.codec.framing);
  }
  Result<void> start(std::optional<Socket> connected, std::chrono::milliseconds patience);
  Result<Socket> open_port(std::size_t port, std::chrono::milliseconds patience);
  void carry_out(protocol::HostActions actions);
  void take(std::size_t port, std::span<const std::byte> bytes);
  void keep(std::size_t port, recording::Origin from, std::span<const std::byte> bytes);
  /// Returns false if a signal ended the wait.
  bool receive(std::chrono::milliseconds patience);
  void read_port(std::size_t port);
  /// UDP has no connection whose end would show that a silent sonar has gone, but a closed port refuses a datagram. An
  /// empty datagram is not a request, so it does not take the sonar from another driver.
  void probe(bool is_silent);
  /// Returns "tcp 127.0.0.2:14750".
  std::string place() const { return (make_->is_by_udp() ? "udp " : "tcp ") + text_from(device_); }

  const Make* make_;
  Endpoint device_;
  std::unique_ptr<protocol::Host> host_;
  std::vector<std::optional<Socket>> sockets_;  // by port; nullopt for HTTP
  std::uint32_t device_ip_ = 0;                 // in network order
  std::chrono::milliseconds answer_patience_{};
  bool is_lost_ = false;
  std::chrono::steady_clock::time_point probe_at_{};  // time of the next probe
  std::deque<Item> items_;                            // items that next() has not returned yet
  std::string limits_;                                // HostPing::limited of the last ping
  std::optional<Error> ended_;                        // set when the conversation has ended; empty text: the sonar closed it
  bool ended_by_host_ = false;                        // true: the host has made the error ended_
  bool has_answered_ = false;                         // a byte arrived at the first port
  bool is_turned_away_ = false;                       // the sonar closed the connection before it answered
  bool is_started_ = false;                           // the destructor must send what on_leave() returns
  std::ofstream record_;
  std::filesystem::path raw_file_;  // to which record_ writes
  bool keeps_ = false;
  std::vector<recording::RecordedMessage> kept_;  // messages since the last item
  // While messages are kept: a splitter per port, so that messages of different ports are not mixed.
  std::map<std::size_t, recording::MessageSplitter> splitters_;
  UnixTime unix_time_;
  std::vector<std::byte> chunk_ = std::vector<std::byte>(1 << 16);
};

/// A device whose beacon discover() received. It waits only for the first make whose beacons contain the address for hosts.
struct Discovered {
  Endpoint device;
  protocol::Announcement announced;
};
Result<Discovered> discover(std::chrono::milliseconds patience);

}  // namespace sonar::clients
