// Reading of HTTP requests: every split of the bytes gives the same requests, limits hold, other bytes are refused with a status.
#include "daemon/server/connections/http_reader.hpp"

#include <gmock/gmock.h>

#include <vector>

namespace sonar {
namespace {

using testing::HasSubstr;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text.data(), text.size())); }

struct Taken {
  std::vector<HttpRequest> requests;
  unsigned refused = 0;
  std::string why;
};
Taken take(const std::string& stream, std::size_t piece) {
  Taken taken;
  HttpReader reader;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    reader.feed(bytes_of(stream.substr(at, piece)));
    while (true) {
      auto next = reader.next();
      if (!next) {
        taken.refused = next.error().status;
        taken.why = next.error().why;
        return taken;
      }
      if (!*next) break;
      taken.requests.push_back(**std::move(next));
    }
  }
  return taken;
}
Taken take(const std::string& stream) { return take(stream, stream.size()); }

const std::string get = "GET /api/v1/status HTTP/1.1\r\nHost: 127.0.0.1:8088\r\nAuthorization: Bearer abc\r\n\r\n";
const std::string post =
    "POST /api/v1/sonar HTTP/1.1\r\nhost: localhost\r\nContent-Type: application/json\r\nOrigin: null\r\nContent-Length: "
    "13\r\n\r\n{\"range_m\":5}";
const std::string chunked =
    "POST /x HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5;a=b\r\nhello\r\n1\r\n!\r\n0\r\nTrailer: x\r\n\r\n";
const std::string no_chunk = "POST /y HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n";
const std::string old = "GET / HTTP/1.0\r\n\r\n";

TEST(HttpReader, JoinsTheHeadersThatBrowsersChooseAFileBy) {
  const Taken t = take(
      "GET / HTTP/1.1\r\nHost: a\r\nAccept: text/html\r\nAccept: */*;q=0.1\r\nAccept-Encoding: gzip\r\n"
      "If-None-Match: \"x\"\r\n\r\n");
  ASSERT_EQ(t.requests.size(), 1u);
  EXPECT_EQ(t.requests[0].accept, "text/html, */*;q=0.1");
  EXPECT_EQ(t.requests[0].accept_encoding, "gzip");
  EXPECT_EQ(t.requests[0].if_none_match, "\"x\"");
}

TEST(HttpReader, ABodyInAnotherCodingIsNotReadAsARequest) {
  const std::string smuggled = "POST /smuggled HTTP/1.1\r\nHost: a\r\nContent-Length: 2\r\n\r\n{}";
  for (const std::string coding :
       {"identity", "gzip", "chunked, identity", "gzip, chunked", "nonsense", "chunked\r\nTransfer-Encoding: x"})
    for (const std::string length : {"", "Content-Length: 0\r\n"}) {
      const std::string stream =
          "POST /x HTTP/1.1\r\nHost: a\r\n" + length + "Transfer-Encoding: " + coding + "\r\n\r\n" + smuggled;
      for (const std::size_t piece : {std::size_t{1}, stream.size()}) {
        const Taken t = take(stream, piece);
        EXPECT_TRUE(t.requests.empty()) << coding;
        EXPECT_TRUE(t.refused == 501 || t.refused == 400) << coding << ": a refusal is final";
      }
    }
  EXPECT_EQ(take("POST /x HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: Chunked\r\n\r\n0\r\n\r\n").requests.size(), 1u);
}

TEST(HttpReader, TwoOriginsAreRefused) {
  const Taken t = take("GET / HTTP/1.1\r\nHost: a\r\nOrigin: http://localhost\r\nOrigin: http://evil.example\r\n\r\n");
  EXPECT_EQ(t.refused, 400u);
  EXPECT_THAT(t.why, HasSubstr("more than one Origin"));
}

TEST(HttpReader, EverySplitGivesTheSameRequests) {
  const std::string stream = get + post + chunked + no_chunk + old;
  for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
    const Taken t = take(stream, piece);
    ASSERT_EQ(t.requests.size(), 5u) << "pieces of " << piece << ": " << t.why;
    EXPECT_EQ(t.requests[0].method, "GET");
    EXPECT_EQ(t.requests[0].target, "/api/v1/status");
    EXPECT_EQ(t.requests[0].host, "127.0.0.1:8088");
    EXPECT_EQ(t.requests[0].authorization, "Bearer abc");
    EXPECT_FALSE(t.requests[0].has_origin);
    EXPECT_TRUE(t.requests[0].keep_alive);
    EXPECT_EQ(t.requests[1].body, "{\"range_m\":5}");
    EXPECT_EQ(t.requests[1].content_type, "application/json");
    EXPECT_TRUE(t.requests[1].has_origin);
    EXPECT_EQ(t.requests[2].body, "hello!");
    EXPECT_EQ(t.requests[3].body, "");
    EXPECT_TRUE(t.requests[4].http_1_0);
    EXPECT_FALSE(t.requests[4].keep_alive);
    EXPECT_FALSE(t.requests[4].has_host);
  }
}

TEST(HttpReader, LimitsHaveTheirOwnStatus) {
  EXPECT_EQ(take("GET / HTTP/1.1\r\nHost: a\r\nX: " + std::string(9000, 'x') + "\r\n\r\n").refused, 431u);
  EXPECT_EQ(take("GET /" + std::string(9000, 'x')).refused, 431u) << "the line has not ended yet";
  const std::string post_of = "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: ";
  EXPECT_EQ(take(post_of + "1048577\r\n\r\n").refused, 413u) << "no byte of the body has come yet";
  const Taken longest = take(post_of + "1048576\r\n\r\n" + std::string(1048576, 'x'), 16384);
  ASSERT_EQ(longest.requests.size(), 1u) << longest.why;
  EXPECT_EQ(longest.requests[0].body.size(), 1048576u);
  std::string chunks = "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 17; ++i) chunks += "10000\r\n" + std::string(65536, 'x') + "\r\n";
  EXPECT_EQ(take(chunks, 16384).refused, 413u);
}

TEST(HttpReader, OtherProtocolsAreRefused) {
  for (const char* bad :
       {"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", "hello\r\n\r\n", "GET /\r\n\r\n", "GET / HTTP/1.1\r\nbroken line\r\n\r\n",
        "GET / HTTP/1.1\r\nHost : a\r\n\r\n", "POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
        "POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        "POST / HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n\r\n",
        "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n", "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n"})
    EXPECT_EQ(take(bad).refused, 400u) << bad;
  EXPECT_EQ(take("GET / HTTP/2.0\r\n\r\n").refused, 505u);
  const Taken bare = take("GET / HTTP/1.1\nHost: a\n\n");
  EXPECT_EQ(bare.refused, 400u);
  EXPECT_EQ(bare.why, "lines of a request end in CR LF, and this one ends in LF alone");
}

TEST(HttpReader, EndlessChunkHeadersAndTrailersAreBounded) {
  const std::string head = "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n";
  EXPECT_EQ(take(head + "1;" + std::string(200000, 'x'), 16384).refused, 400u);
  std::string trailers = head + "0\r\n";
  for (int i = 0; i < 20000; ++i) trailers += "X: yyyyyyyyyyyy\r\n";
  EXPECT_NE(take(trailers, 16384).refused, 0u);
}

TEST(HttpReader, BodiesAreBoundedAsConfigured) {
  HttpReader reader(100);
  reader.feed(bytes_of("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 101\r\n\r\n" + std::string(101, ' ')));
  const auto next = reader.next();
  ASSERT_FALSE(next);
  EXPECT_EQ(next.error().status, 413u);
}

TEST(HttpReader, ExpectContinueIsAnsweredOnce) {
  HttpReader reader;
  EXPECT_FALSE(reader.begun());
  reader.feed(bytes_of("POST / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n"));
  EXPECT_TRUE(reader.begun());
  ASSERT_TRUE(reader.next());
  EXPECT_TRUE(reader.asks_to_continue());
  EXPECT_FALSE(reader.asks_to_continue());
  reader.feed(bytes_of("{}"));
  const auto next = reader.next();
  ASSERT_TRUE(next && *next);
  EXPECT_EQ((*next)->body, "{}");
  EXPECT_FALSE(reader.begun());
}

TEST(HttpReader, FlippedBytesAreReadOrRefusedNeverFatal) {
  const std::string stream = post + chunked;
  for (std::size_t at = 0; at < stream.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string flipped = stream;
      flipped[at] = static_cast<char>(flipped[at] ^ (1 << bit));
      const Taken t = take(flipped, 7);
      EXPECT_LE(t.requests.size(), 2u);
      EXPECT_TRUE(t.refused == 0 || !t.why.empty());
    }
  }
}

}  // namespace
}  // namespace sonar
