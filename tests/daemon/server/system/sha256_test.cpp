// Tests with the FIPS 180-4 examples (NIST "SHA-256 example values"), and with messages in pieces.
#include "daemon/server/system/sha256.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace sonar {
namespace {

TEST(Sha256, KnownAnswers) {
  EXPECT_EQ(sha256_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_of(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, AnySplitGivesTheSameDigest) {
  std::string text;
  for (int i = 0; i < 300; ++i) text += static_cast<char>(i * 7);
  const std::string whole = sha256_of(text);
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    Sha256 sha;
    sha.add(std::as_bytes(std::span(text.data(), cut)));
    sha.add(std::as_bytes(std::span(text.data() + cut, text.size() - cut)));
    ASSERT_EQ(sha.hex(), whole) << "cut at " << cut;
    ASSERT_EQ(sha.size(), text.size());
  }
}

}  // namespace
}  // namespace sonar
