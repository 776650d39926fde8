// Tests messages that a fault changes: they must be written in pieces, and the connection must end after exactly their bytes.
#include "daemon/server/sonars/session.hpp"

#include <gmock/gmock.h>

#include <deque>

#include "tests/daemon/server/loopback.hpp"
#include "tests/daemon/server/sonars/session_parent.hpp"

namespace sonar::testing_daemon::session_test {
namespace {

using std::chrono::duration_cast;
using ::testing::ElementsAre;

struct Parent final : QuietParent {
  std::deque<Outbox::Message> messages;
  int written = 0;
  Outbox::Message next_message(ConnectionId) override {
    if (messages.empty()) return {};
    Outbox::Message next = std::move(messages.front());
    messages.pop_front();
    return next;
  }
  void on_written(ConnectionId, const Outbox::Message&) override { ++written; }
};

Outbox::Message shaped(const std::string& text, Outbox::Shape shape) {
  Outbox::Message message;
  message.bytes = std::make_shared<const Outbox::Bytes>(bytes_of(text));
  message.shape = std::make_shared<const Outbox::Shape>(std::move(shape));
  return message;
}

struct SessionShapes : ::testing::Test {
  ~SessionShapes() override {
    if (parent.why.empty()) session->reset("the test is over");
    io.run_for(milliseconds(200));
  }
  void start(std::vector<Outbox::Message> messages, milliseconds stall = milliseconds(10000)) {
    Session::Setup setup;
    setup.limits.stall = stall;
    parent.messages.assign(messages.begin(), messages.end());
    session = std::make_shared<Session>(parent, acceptor.accept(), setup);
    began = Steady::now();
    session->start();
  }
  /// A piece of the stream that read_until_end_or() has received, with its time since start().
  struct Piece {
    std::string text;
    milliseconds at;
  };
  std::vector<Piece> read_until_end_or(std::size_t bytes, milliseconds timeout = patience) {
    std::vector<Piece> pieces;
    const auto deadline = Steady::now() + timeout;
    for (std::size_t all = 0; all < bytes && !client.ended && Steady::now() < deadline;) {
      io.restart();
      io.run_for(milliseconds(1));
      const auto raw = client.read_raw(1, milliseconds(1));
      if (raw.empty()) continue;
      all += raw.size();
      pieces.push_back(
          {{reinterpret_cast<const char*>(raw.data()), raw.size()}, duration_cast<milliseconds>(Steady::now() - began)});
    }
    return pieces;
  }

  asio::io_context io;
  tcp::acceptor acceptor{io, {asio::ip::make_address("127.0.0.2"), 0}};
  Client client{acceptor.local_endpoint().address().to_string(), acceptor.local_endpoint().port()};
  Parent parent;
  std::shared_ptr<Session> session;
  Steady::time_point began;
};

std::vector<std::string> texts_of(const std::vector<SessionShapes::Piece>& pieces) {
  std::vector<std::string> texts;
  for (const auto& piece : pieces) texts.push_back(piece.text);
  return texts;
}
std::string joined(const std::vector<SessionShapes::Piece>& pieces) {
  std::string all;
  for (const auto& piece : pieces) all += piece.text;
  return all;
}

TEST_F(SessionShapes, PiecesArriveWithPauses) {
  start({shaped("abcdefgh", {{{0, milliseconds(200)}, {3, milliseconds(200)}, {3, {}}, {7, milliseconds(200)}}}),
         shaped("ijk", {})});
  const auto pieces = read_until_end_or(11);
  ASSERT_GE(pieces.size(), 3u) << "the last piece may include the second message";
  EXPECT_EQ(pieces[0].text, "abc");
  EXPECT_EQ(pieces[1].text, "defg");
  EXPECT_EQ(pieces[2].text.front(), 'h');
  EXPECT_EQ(joined(pieces), "abcdefghijk");
  EXPECT_GE(pieces[0].at, milliseconds(200));
  EXPECT_GE(pieces[1].at, milliseconds(400));
  EXPECT_GE(pieces[2].at, milliseconds(600));
  io.restart();  // the last byte may arrive before the session counts its message
  for (int turns = 0; parent.written < 2 && turns < 1000; ++turns) io.run_one_for(milliseconds(10));
  EXPECT_EQ(parent.written, 2);
}

TEST_F(SessionShapes, APauseOfAFaultIsNoStallOfTheClient) {
  start({shaped("ab", {{{1, milliseconds(1500)}}})}, milliseconds(200));
  EXPECT_THAT(texts_of(read_until_end_or(2)), ElementsAre("a", "b"));
  EXPECT_FALSE(client.ended);
}

TEST_F(SessionShapes, AFinishEndsThePause) {
  start({shaped("ab", {{{1, std::chrono::hours(1)}}}), shaped("never", {})});
  EXPECT_THAT(texts_of(read_until_end_or(1)), ElementsAre("a"));
  parent.messages.clear();
  session->finish("sonard stops");
  EXPECT_EQ(joined(read_until_end_or(2)), "b");
  EXPECT_TRUE(client.ended);
  EXPECT_FALSE(client.was_reset);
}

TEST_F(SessionShapes, FinComesAfterTheLastByteAndNothingElse) {
  start({shaped("abc", {{}, Outbox::Shape::End::fin}), shaped("never", {})});
  EXPECT_EQ(joined(read_until_end_or(100)), "abc");
  EXPECT_TRUE(client.ended);
  EXPECT_FALSE(client.was_reset);
  EXPECT_EQ(parent.written, 1);
  client.close();
  io.restart();
  io.run_for(milliseconds(100));
  EXPECT_EQ(parent.why, "a fault ended the stream");
}

TEST_F(SessionShapes, ResetComesAfterTheLastByte) {
  const std::string large(3u << 20, 'x');  // more than the kernels hold
  start({shaped(large, {{{1, milliseconds(50)}}, Outbox::Shape::End::reset}), shaped("never", {})});
  EXPECT_EQ(joined(read_until_end_or(large.size() + 1)).size(), large.size());
  EXPECT_TRUE(client.was_reset);
  EXPECT_EQ(parent.written, 1);
  EXPECT_EQ(parent.why, "a fault reset the connection");
  EXPECT_FALSE(parent.client_left);
}

TEST_F(SessionShapes, ReportsThatTheClientLeft) {
  start({});
  client.close();
  io.restart();
  for (int turns = 0; parent.why.empty() && turns < 1000; ++turns) io.run_one_for(milliseconds(10));
  EXPECT_EQ(parent.why, "closed by the client");
  EXPECT_TRUE(parent.client_left);
}

TEST_F(SessionShapes, ReportsThatTheClientLeftDuringAMessage) {
  start({shaped(std::string(16u << 20, 'x'), {})});  // more than the kernels hold
  session->read_from_client(false);
  client.send(std::string("x"));  // this unread byte hides the end from the reader, so only the writer can detect it
  io.restart();
  while (io.run_one_for(milliseconds(100)) > 0) continue;
  EXPECT_EQ(parent.why, "");
  client.close();
  for (int turns = 0; parent.why.empty() && turns < 1000; ++turns) io.run_one_for(milliseconds(10));
  EXPECT_NE(parent.why, "");
  EXPECT_TRUE(parent.client_left) << parent.why;
}

TEST_F(SessionShapes, AnEmptyMessageEndsAtABoundary) {
  start({shaped("abc", {}), shaped("", {{}, Outbox::Shape::End::reset})});
  EXPECT_EQ(joined(read_until_end_or(100)), "abc");
  EXPECT_TRUE(client.was_reset);
  EXPECT_EQ(parent.written, 2);
}

}  // namespace
}  // namespace sonar::testing_daemon::session_test
