// Those who look on at a sonar: connections to a port of their own, which get every ping that its clients get, in the same bytes,
// and count for nothing. Nobody is pinged for them, what they ask changes nothing, and they have no client's place.
// Owned by Device. I/O thread only.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>

#include "core/base/result.hpp"
#include "daemon/sonars/session.hpp"
#include "daemon/system/asio.hpp"
#include "daemon/system/log.hpp"

namespace sonar {

struct DeviceContext;

class Observers final : public SessionParent {
 public:
  /// Begins the conversation with one more.
  using Converse = std::function<std::unique_ptr<protocol::Dialogue>()>;

  /// All of it outlives them.
  Observers(DeviceContext& context, const SonarConfig& config, Converse converse);
  ~Observers() override;

  /// At the sonar's address. Errors name the address and the next step.
  Result<void> open();
  void start();
  void stop(const std::string& why);
  bool gone() const { return sessions_.empty(); }  // after stop()

  void push_ping(const std::shared_ptr<const protocol::Bytes>& bytes, const PingRequest& ping, protocol::BytesView made_with);
  /// Stepped time: what is due in their conversations.
  void tick();

  /// Where they connect. Port 0 = nowhere.
  Endpoint at() const { return at_; }
  std::size_t count() const { return sessions_.size(); }

  void on_event(Session& from, const protocol::Event& event) override;
  void on_written(Session&, const Outbox::Message&) override {}
  void on_fault(Session& session, const std::string& what) override;
  void on_over(Session& session, const std::string& why) override;

 private:
  void keep_accepting();
  asio::awaitable<void> accept();
  void admit(tcp::socket socket);
  void say(const std::string& what, const Session* of);

  DeviceContext& context_;
  const SonarConfig& config_;
  Converse converse_;
  tcp::acceptor acceptor_;
  Endpoint at_;
  std::list<std::shared_ptr<Session>> sessions_;
  std::uint64_t ever_ = 0;
  bool stopping_ = false;
  LogLimiter visits_, ignored_, faults_;
};

}  // namespace sonar
