// Tests the link with a small made-up sonar that misbehaves on command, on loopback and a free port, with time limits.
#include "clients/bvtsdk/core/link.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <cstdio>
#include <fstream>
#include <future>
#include <iterator>

#include "clients/bvtsdk/core/log.hpp"

namespace sonar::bvt {
namespace {

using namespace std::chrono_literals;

const Patience patient{10s, 10s, 50ms, 20s};

SonarDescription some_sonar() {
  SonarDescription sonar;
  sonar.model = "Fake";
  sonar.temperature_c = 12.5f;
  HeadDescription head;
  head.name = "Head";
  head.max_range_m = 60;
  sonar.heads.push_back(head);
  return sonar;
}

/// The sonar's end of a link: it records its host's messages and answers them.
class Peer {
 public:
  explicit Peer(int fd) : socket_(fd) {}
  /// Returns the next frame; it skips keep-alive frames unless they are requested. Type 0 = the host has left.
  FrameHeader next(Bytes& payload, bool keep_alives = false) {
    for (;;) {
      FrameHeader header;
      Bytes head = exactly(frame_header_size);
      if (!read_header(head, header)) return {};
      payload = exactly(header.payload_size);
      if (keep_alives || header.type != FrameType::keep_alive) return header;
    }
  }
  void send(const FrameHeader& header, const Bytes& payload) {
    Bytes frame;
    FrameHeader with_size = header;
    with_size.payload_size = static_cast<std::uint32_t>(payload.size());
    put_header(frame, with_size);
    frame.insert(frame.end(), payload.begin(), payload.end());
    send_raw(frame);
  }
  void send_raw(const Bytes& bytes) { send_all(socket_.fd(), bytes, std::chrono::steady_clock::now() + 5s); }
  void reply(const FrameHeader& request, const Bytes& payload) {
    send({static_cast<FrameType>(static_cast<int>(request.type) | 0x8000), 0, request.request_id, 0}, payload);
  }
  void greet(std::uint32_t capabilities = 0) {
    Bytes payload;
    const FrameHeader hello = next(payload);
    EXPECT_EQ(hello.type, FrameType::hello);
    SonarDescription sonar = some_sonar();
    sonar.capabilities |= capabilities;
    reply(hello, encode_description(sonar));
  }
  /// Waits until the host disconnects.
  void wait_for_the_end() {
    Bytes payload;
    while (next(payload).type != FrameType{}) {
    }
  }

 private:
  Bytes exactly(std::size_t size) {
    Bytes out;
    while (out.size() < size) {
      if (wait_for(socket_.fd(), POLLIN, std::chrono::steady_clock::now() + 10s) != success) break;
      if (receive_some(socket_.fd(), out, size - out.size()) != success) break;
    }
    return out;
  }
  Descriptor socket_;
};

/// Accepts one host and calls the test's function with it.
class FakeSonar {
 public:
  explicit FakeSonar(std::function<void(Peer&)> behave) : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    ::inet_pton(AF_INET, "127.0.0.2", &address.sin_addr);
    EXPECT_EQ(::bind(listener_.fd(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ::listen(listener_.fd(), 1);
    socklen_t size = sizeof address;
    ::getsockname(listener_.fd(), reinterpret_cast<sockaddr*>(&address), &size);
    endpoint_ = "127.0.0.2:" + std::to_string(ntohs(address.sin_port));
    thread_ = std::thread([this, behave = std::move(behave)] {
      if (wait_for(listener_.fd(), POLLIN, std::chrono::steady_clock::now() + 10s) != success) return;
      Peer peer(::accept4(listener_.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      behave(peer);
    });
  }
  ~FakeSonar() { thread_.join(); }
  const std::string& endpoint() const { return endpoint_; }
  Code open(std::unique_ptr<Link>& link, const Patience& patience = patient) {
    SonarDescription sonar;
    return Link::open(endpoint_, 4, link, sonar, patience);
  }

 private:
  Descriptor listener_;
  std::string endpoint_;
  std::thread thread_;
};

TEST(Link, GreetsAndReceivesTheDescription) {
  FakeSonar fake([](Peer& peer) {
    Bytes payload;
    const FrameHeader hello = peer.next(payload);
    Reader reader(payload);
    EXPECT_EQ(reader.read<std::uint16_t>(), 1);
    EXPECT_EQ(reader.read<std::uint16_t>(), 3);
    EXPECT_FALSE(reader.text().empty());
    peer.reply(hello, encode_description(some_sonar()));
    peer.wait_for_the_end();
  });
  std::unique_ptr<Link> link;
  SonarDescription sonar;
  ASSERT_EQ(Link::open(fake.endpoint(), 3, link, sonar, patient), success);
  EXPECT_TRUE(link->connected());
  EXPECT_EQ(sonar.model, "Fake");
  EXPECT_EQ(sonar.temperature_c, 12.5f);
  ASSERT_EQ(sonar.heads.size(), 1u);
  EXPECT_EQ(sonar.heads[0].max_range_m, 60);
}

TEST(Link, RepliesAreMatchedToRequestsInAnyOrder) {
  FakeSonar fake([](Peer& peer) {
    peer.greet();
    Bytes first, second;
    const FrameHeader one = peer.next(first), two = peer.next(second);
    peer.reply(two, second);
    peer.reply(one, first);
    peer.wait_for_the_end();
  });
  std::unique_ptr<Link> link;
  ASSERT_EQ(fake.open(link), success);
  const auto ask = [&link](std::uint8_t what) {
    Bytes answer;
    EXPECT_EQ(link->ask(FrameType::get, {what}, answer), success);
    return answer;
  };
  std::future<Bytes> other = std::async(std::launch::async, ask, std::uint8_t{1});
  EXPECT_THAT(ask(2), testing::ElementsAre(2));
  EXPECT_THAT(other.get(), testing::ElementsAre(1));
}

TEST(Link, RefusalsArriveWithTheirCode) {
  FakeSonar fake([](Peer& peer) {
    peer.greet();
    Bytes payload, refusal;
    put(refusal, std::int32_t{bad_range});
    put_text(refusal, "too far");
    const FrameHeader request = peer.next(payload);
    peer.send({FrameType::error, 0, request.request_id, 0}, refusal);
    peer.wait_for_the_end();
  });
  std::unique_ptr<Link> link;
  ASSERT_EQ(fake.open(link), success);
  Bytes answer;
  EXPECT_EQ(link->ask(FrameType::set, {}, answer), bad_range);
  EXPECT_TRUE(link->connected());
}

TEST(Link, SendsKeepAliveInSilence) {
  std::atomic<int> heard{0};
  {
    FakeSonar fake([&heard](Peer& peer) {
      peer.greet();
      Bytes payload;
      for (int i = 0; i < 8; ++i) {
        if (peer.next(payload, true).type == FrameType::keep_alive) ++heard;
        peer.send({FrameType::keep_alive, 0, 0, 0}, {});
      }
      peer.wait_for_the_end();
    });
    std::unique_ptr<Link> link;
    ASSERT_EQ(fake.open(link), success);
    for (int i = 0; i < 1500 && heard < 8; ++i) std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(heard, 8);
}

TEST(Link, ASonarWhoseTimeMayStandIsNotGivenUp) {
  FakeSonar fake([](Peer& peer) {
    peer.greet(2);
    peer.wait_for_the_end();
  });
  std::unique_ptr<Link> link;
  const Patience impatient{10s, 10s, 50ms, 100ms};
  ASSERT_EQ(fake.open(link, impatient), success);
  std::this_thread::sleep_for(1s);
  EXPECT_TRUE(link->connected());
}

TEST(Link, ASilentSonarIsGivenUp) {
  FakeSonar fake([](Peer& peer) {
    peer.greet();
    peer.wait_for_the_end();
  });
  std::unique_ptr<Link> link;
  ASSERT_EQ(fake.open(link, {10s, 10s, 50ms, 400ms}), success);
  Bytes answer;
  EXPECT_EQ(link->ask(FrameType::ping, {}, answer, 10s), socket_read_timeout);
  EXPECT_FALSE(link->connected());
  EXPECT_EQ(link->ask(FrameType::ping, {}, answer, 10s), socket_read_timeout);
}

TEST(Link, AReplyThatComesTooLateIsForgotten) {
  FakeSonar fake([](Peer& peer) {
    peer.greet();
    Bytes first, second;
    const FrameHeader one = peer.next(first), two = peer.next(second);
    peer.reply(one, first);
    peer.reply(two, second);
    peer.wait_for_the_end();
  });
  std::unique_ptr<Link> link;
  ASSERT_EQ(fake.open(link), success);
  Bytes answer;
  EXPECT_EQ(link->ask(FrameType::get, {1}, answer, 20ms), socket_read_timeout);
  EXPECT_TRUE(link->connected());
  EXPECT_EQ(link->ask(FrameType::get, {2}, answer), success);
  EXPECT_THAT(answer, testing::ElementsAre(2));
}

TEST(Link, ATruncatedFrameEndsTheLink) {
  FakeSonar fake([](Peer& peer) {
    peer.greet();
    Bytes payload, cut;
    const FrameHeader request = peer.next(payload);
    put_header(cut, {FrameType::ping_data, 0, request.request_id, 1000});
    cut.resize(500);
    peer.send_raw(cut);
  });
  std::unique_ptr<Link> link;
  ASSERT_EQ(fake.open(link), success);
  Bytes answer;
  EXPECT_EQ(link->ask(FrameType::ping, {}, answer), socket_closed);
  EXPECT_FALSE(link->connected());
}

TEST(Link, BytesThatAreNotAFrameEndTheLink) {
  for (const bool too_long : {false, true}) {
    FakeSonar fake([too_long](Peer& peer) {
      peer.greet();
      Bytes payload, bad;
      const FrameHeader request = peer.next(payload);
      put_header(bad, {FrameType::ping_data, 0, request.request_id, too_long ? 0xFFFFFFFFu : 0});
      if (!too_long) bad[0] = 'X';
      peer.send_raw(bad);
      peer.wait_for_the_end();
    });
    std::unique_ptr<Link> link;
    ASSERT_EQ(fake.open(link), success);
    Bytes answer;
    EXPECT_EQ(link->ask(FrameType::ping, {}, answer), bad_packet_type);
  }
}

TEST(Link, ClosingEndsWaitingCalls) {
  std::promise<void> asked;
  FakeSonar fake([&asked](Peer& peer) {
    peer.greet();
    Bytes payload;
    peer.next(payload);
    asked.set_value();
    peer.wait_for_the_end();
  });
  std::unique_ptr<Link> link;
  ASSERT_EQ(fake.open(link), success);
  std::future<int> code = std::async(std::launch::async, [&link] {
    Bytes answer;
    return link->ask(FrameType::ping, {}, answer, 20s);
  });
  asked.get_future().wait();
  link->close();
  EXPECT_EQ(code.get(), socket_closed);
}

/// Returns the log lines of the library while `work` runs.
template <class F>
std::string logged(const F& work) {
  const std::string path = testing::TempDir() + "bvtsdk_link_test.log";
  std::remove(path.c_str());
  EXPECT_TRUE(set_log_target(path));
  work();
  set_log_target("stderr");
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(LinkOpen, LogsWhatFailedWhereAndWhatToDo) {
  std::unique_ptr<Link> link;
  SonarDescription sonar;
  const auto opening = [&](const std::string& endpoint) { return logged([&] { Link::open(endpoint, 4, link, sonar); }); };
  using testing::AllOf, testing::HasSubstr;
  EXPECT_THAT(opening("127.0.0.3:1"),
              AllOf(HasSubstr("\"127.0.0.3:1\": TCP port 1: Connection refused; check that sonard runs"), HasSubstr("BVE_PORT")));
  EXPECT_THAT(opening("not an address"), AllOf(HasSubstr("\"not an address\""), HasSubstr("check the host's name")));
  EXPECT_THAT(opening("127.0.0.1:port"), AllOf(HasSubstr("\"127.0.0.1:port\""), HasSubstr("HOST:PORT")));
  FakeSonar gone([](Peer&) {});
  EXPECT_THAT(logged([&] { gone.open(link); }), AllOf(HasSubstr(gone.endpoint()), HasSubstr("closes it at once")));
  FakeSonar silent([](Peer& peer) { peer.wait_for_the_end(); });
  EXPECT_THAT(logged([&] { silent.open(link, {200ms, 10s, 50ms, 20s}); }), HasSubstr("sends no greeting"));
  FakeSonar stranger([](Peer& peer) {
    peer.send_raw(Bytes(64, 'H'));
    peer.wait_for_the_end();
  });
  EXPECT_THAT(logged([&] { stranger.open(link); }), HasSubstr("check the port"));
  FakeSonar right([](Peer& peer) {
    peer.greet();
    peer.wait_for_the_end();
  });
  EXPECT_EQ(logged([&] { right.open(link); }), "");
  link.reset();
}

TEST(LinkOpen, ReportsWhyNoSonarIsReached) {
  std::unique_ptr<Link> link;
  SonarDescription sonar;
  for (const char* endpoint : {"", ":14750", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:port"})
    EXPECT_EQ(Link::open(endpoint, 4, link, sonar), bad_parameter) << endpoint;
  EXPECT_EQ(Link::open("127.0.0.3:1", 4, link, sonar), connection_timed_out);  // refused
  EXPECT_EQ(Link::open("not an address", 4, link, sonar), lookup_host);
  EXPECT_EQ(link, nullptr);
}

TEST(LinkOpen, ASonarThatClosesOrIsSilentIsNotReached) {
  std::unique_ptr<Link> link;
  FakeSonar gone([](Peer&) {});
  EXPECT_EQ(gone.open(link), connection_timed_out);
  FakeSonar silent([](Peer& peer) { peer.wait_for_the_end(); });
  EXPECT_EQ(silent.open(link, {200ms, 10s, 50ms, 20s}), connection_timed_out);
}

TEST(LinkOpen, OtherServicesAndVersionsHaveTheirCodes) {
  std::unique_ptr<Link> link;
  FakeSonar stranger([](Peer& peer) {
    peer.send_raw(Bytes(64, 'H'));
    peer.wait_for_the_end();
  });
  EXPECT_EQ(stranger.open(link), bad_packet_type);
  FakeSonar newer([](Peer& peer) {
    Bytes payload, refusal;
    const FrameHeader hello = peer.next(payload);
    put(refusal, std::int32_t{bad_packet_version});
    put_text(refusal, "version 2 only");
    peer.send({FrameType::error, 0, hello.request_id, 0}, refusal);
    peer.wait_for_the_end();
  });
  EXPECT_EQ(newer.open(link), bad_packet_version);
}

TEST(Description, HeadsAreNamedFromZeroOrOneUnlessStrict) {
  SonarDescription sonar = some_sonar();
  EXPECT_EQ(sonar.head(0), &sonar.heads[0]);
  EXPECT_EQ(sonar.head(1), &sonar.heads[0]);
  EXPECT_EQ(sonar.head(2), nullptr);
  EXPECT_EQ(sonar.head(-1), nullptr);
  sonar.capabilities = 1;
  EXPECT_EQ(sonar.head(1), nullptr);
  sonar.capabilities = 0;
  sonar.heads.push_back(sonar.heads[0]);
  sonar.heads[1].id = 1;
  EXPECT_EQ(sonar.head(1), &sonar.heads[1]);
}

TEST(Description, IsReadBackOnlyIfWhole) {
  const SonarDescription sonar = some_sonar();
  Bytes bytes = encode_description(sonar);
  const auto back = decode_description(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(encode_description(*back), bytes);
  while (!bytes.empty()) {
    bytes.pop_back();
    EXPECT_FALSE(decode_description(bytes)) << bytes.size();
  }
}

}  // namespace
}  // namespace sonar::bvt
