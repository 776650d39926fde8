// The host's end of BVE1: one TCP connection to a sonar, requests and their replies, keep-alive.
// docs/protocols/blueview-link.md describes it. Any number of threads may send requests at once; each receives its own reply.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/description.hpp"
#include "clients/bvtsdk/core/frame.hpp"
#include "clients/bvtsdk/core/socket.hpp"

namespace sonar::bvt {

/// Time limits. Tests shorten them.
struct Patience {
  std::chrono::milliseconds connect{5000};    // for name lookup and connection, then for the greeting
  std::chrono::milliseconds request{5000};    // for a reply that needs no ping
  std::chrono::milliseconds silence{2000};    // a keep-alive is sent when we have sent nothing for this long
  std::chrono::milliseconds lifeless{10000};  // the link is lost when the sonar has sent no byte for this long
};

class Link {
 public:
  /// `endpoint` is "host" or "host:port"; the default port is that of the environment variable BVE_PORT, else 14750. Returns
  /// bad_parameter, lookup_host, connection_timed_out (refused, unreachable, or silent), bad_packet_type (another service
  /// replies) or bad_packet_version. A failure is logged with its reason.
  static Code open(const std::string& endpoint, int abi, std::unique_ptr<Link>& link, SonarDescription& sonar,
                   const Patience& patience = {});
  /// Closes the link, and waits until the reader thread has ended.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Sends a request and waits for its reply. Returns the sonar's code if the sonar refuses, socket_read_timeout if no reply
  /// comes in time, or the cause (socket_closed, socket_read_timeout, ...) if the link is lost.
  int ask(FrameType request, const Bytes& payload, Bytes& answer, std::chrono::milliseconds patience);
  int ask(FrameType request, const Bytes& payload, Bytes& answer) { return ask(request, payload, answer, patience_.request); }

  bool connected() const { return lost_ == success; }
  /// Closes the connection; waiting calls return socket_closed. May be called from any thread.
  void close() { lose(socket_closed); }

 private:
  struct Waiter {
    FrameType request{};
    bool answered = false;
    int code = success;
    Bytes answer;
  };
  struct Forget;
  Link(Descriptor socket, const Patience& patience);
  void read_until_lost();
  void receive();
  void deliver(const FrameHeader& header, Bytes payload);
  Code send(FrameType type, std::uint32_t id, const Bytes& payload);
  void keep_alive();
  void lose(Code why);

  const Patience patience_;
  Descriptor socket_;
  std::atomic<Code> lost_{success};
  std::atomic<bool> may_be_silent_{false};  // the sonar's time may stop, so silence is not a fault; TCP reports a lost sonar

  std::mutex waiting_mutex_;
  std::condition_variable answered_;
  std::map<std::uint32_t, Waiter*> waiting_;
  std::uint32_t last_id_ = 0;

  std::mutex send_mutex_;
  Deadline last_sent_;

  // Only the reader thread uses the next two members.
  Deadline last_received_;
  Bytes received_;
  std::thread reader_;  // the last member, because it uses all others
};

}  // namespace sonar::bvt
