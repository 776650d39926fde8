// Limits the connections and datagrams of each IP address at the ports of all sonars, in addition to the limits of a session. A
// connection beyond the limit waits, a datagram is dropped; other addresses are not affected.
#pragma once

#include "daemon/server/connections/input_rate.hpp"

namespace sonar {

class PortGuard {
 public:
  using Steady = WorkRate::Steady;
  /// Returns the number of connections that one address may make in a second, or at once: 100 with the default of `per_s`
  /// (limits.input_bytes_per_s). A driver that reconnects needs only a few.
  static constexpr std::size_t connections_per_s(std::size_t per_s) { return std::max<std::size_t>(10, per_s / 10240); }

  /// Returns the time that a connection of the address must wait before it is served; may be 0.
  Steady::duration pause_before_connection(const std::string& address, std::size_t per_s, Steady::time_point now) {
    return connections_.pause_after(address, 1, connections_per_s(per_s), now);
  }
  /// Returns false if the datagram must be dropped. `per_s`: limits.input_bytes_per_s.
  bool takes_datagram(const std::string& address, std::size_t bytes, std::size_t per_s, Steady::time_point now) {
    return datagrams_.takes(address, bytes + work::of_datagram, per_s, now);
  }
  /// Counts the work that a datagram caused.
  void count(const std::string& address, std::size_t amount, std::size_t per_s, Steady::time_point now) {
    datagrams_.pause_after(address, amount, per_s, now);
  }

 private:
  WorkRate connections_, datagrams_;
};

/// Limits the datagrams per second that are read from one socket, for all senders together; further datagrams wait or are lost in
/// the kernel.
class DatagramRate {
 public:
  using Steady = InputRate::Steady;
  /// `most_per_s`: accepted datagrams per second. A dropped datagram uses the fraction `of_dropped` / `all` of a second.
  explicit DatagramRate(std::size_t most_per_s) : of_taken_(all / most_per_s) {}
  /// Returns the pause before the next read; 0 = none.
  Steady::duration pause_after(bool taken, Steady::time_point now) {
    const auto pause = rate_.pause_after(taken ? of_taken_ : of_dropped, now);
    return pause.count() == 0 ? pause : std::max<Steady::duration>(pause, least_pause);
  }

 private:
  static constexpr std::size_t all = 16384, of_dropped = 1;
  static constexpr std::chrono::milliseconds least_pause{5};  // so that a flood does not set a timer for each datagram
  std::size_t of_taken_;
  InputRate rate_{all};
};

}  // namespace sonar
