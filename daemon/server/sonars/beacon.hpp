// Sends the status broadcast of an emulated sonar (Port::Kind::udp_beacon) periodically from a separate port. Device owns it.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

class Beacon {
 public:
  /// `make` returns the present datagrams, in order; `fault` is called with the text of an exception. `log` must outlive the
  /// beacon.
  Beacon(asio::io_context& io, Log& log, std::string sonar, std::function<std::vector<protocol::Bytes>()> make,
         std::function<void(const std::string&)> fault)
      : log_(log), sonar_(std::move(sonar)), make_(std::move(make)), fault_(std::move(fault)), socket_(io), timer_(io) {}

  Result<void> open(const SonarConfig& sonar, const protocol::Port& port);
  void start();
  /// Sends without waiting for the period to pass, but not more often than every `shortest_pause`.
  void send_now() { timer_.expires_at(std::max(std::chrono::steady_clock::now(), sent_at_ + shortest_pause)); }
  void stop();
  const std::vector<udp::endpoint>& destinations() const { return to_; }

 private:
  static constexpr std::chrono::milliseconds shortest_pause{50};
  asio::awaitable<void> send();

  Log& log_;
  std::string sonar_;
  std::function<std::vector<protocol::Bytes>()> make_;
  std::function<void(const std::string&)> fault_;
  udp::socket socket_;
  asio::steady_timer timer_;
  std::chrono::milliseconds period_{0};
  std::chrono::steady_clock::time_point sent_at_{};
  std::vector<udp::endpoint> to_;
  bool stopping_ = false, failed_ = false;
};

}  // namespace sonar
