// A parent of sessions and streams for tests: it has no messages, sets no limits, and stores the reason for the end of the
// conversation.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "daemon/server/sonars/session.hpp"

namespace sonar::testing_daemon {

struct QuietParent : SessionParent {
  std::string why;  // why the conversation has ended; empty before that
  bool client_left = false;
  std::size_t on_bytes(ConnectionId, protocol::BytesView) override { return 0; }
  Outbox::Message next_message(ConnectionId) override { return {}; }
  std::vector<Endpoint> receivers(ConnectionId) override { return {}; }
  void on_sent(ConnectionId, std::size_t) override {}
  void on_written(ConnectionId, const Outbox::Message&) override {}
  void on_not_sent(ConnectionId) override {}
  std::optional<std::chrono::milliseconds> longest_silence(ConnectionId) const override { return std::nullopt; }
  void look_for_host(ConnectionId) override {}
  void on_finish(ConnectionId) override {}
  void on_fault(const std::string& what) override { ADD_FAILURE() << what; }
  void on_send_error(const Endpoint&, const std::string&) override {}
  void on_over(ConnectionId, const std::string& reason, bool by_client) override {
    why = reason;
    client_left = by_client;
  }
};

}  // namespace sonar::testing_daemon
