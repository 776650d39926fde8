// Tokens: the valid contents of a file, and that only the whole secret matches.
#include "daemon/server/connections/token.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace sonar {
namespace {

using testing::HasSubstr;

struct TokenFile : ::testing::Test {
  std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / ("token-" + std::to_string(::getpid()));
  std::string warning;
  Result<Token> read(const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
    std::filesystem::permissions(file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    return Token::read(file, warning);
  }
  std::string refusal(const std::string& text) {
    const auto token = read(text);
    EXPECT_FALSE(token);
    if (token) return "";
    EXPECT_EQ(token.error().kind, ErrorKind::config);
    return token.error().text;
  }
  ~TokenFile() override { std::filesystem::remove(file); }
};

TEST_F(TokenFile, IsTrimmedAndMatchesWhole) {
  const auto token = read("  0123456789abcdef\r\n");
  ASSERT_TRUE(token) << token.error().text;
  EXPECT_TRUE(token->needed());
  EXPECT_TRUE(token->matches("0123456789abcdef"));
  for (const char* wrong : {"", "0123456789abcde", "0123456789abcdef ", "0123456789abcdeF", "0123456789abcdef0"})
    EXPECT_FALSE(token->matches(wrong)) << wrong;
  EXPECT_EQ(warning, "");
}

TEST_F(TokenFile, AFileWithoutASecretIsRefusedWithoutShowingItsText) {
  EXPECT_THAT(refusal(""), HasSubstr("at least 16"));
  EXPECT_THAT(refusal("    \n"), HasSubstr("at least 16"));
  const std::string text = refusal("tooshort");
  EXPECT_THAT(text, HasSubstr("openssl rand"));
  EXPECT_EQ(text.find("tooshort"), std::string::npos);
  EXPECT_THAT(refusal("0123456789abcdef\n0123456789abcdef"), HasSubstr("one line"));
  EXPECT_THAT(refusal(std::string(1025, 'a')), HasSubstr("at most 1024"));
  EXPECT_THAT(refusal(std::string(100000, 'a')), HasSubstr("at most 1024"));
  std::filesystem::remove(file);
  const auto missing = Token::read(file, warning);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().text, HasSubstr("cannot be read"));
  EXPECT_THAT(missing.error().text, HasSubstr("make one: (umask 077"));
  const auto folder = Token::read(::testing::TempDir(), warning);
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().text, HasSubstr(": is a folder, not a regular file; name a file in it"));
  EXPECT_EQ(folder.error().text.find("make one"), std::string::npos)
      << "a folder has this name, so the advice to make a file would be wrong";
  std::filesystem::create_symlink(file, file);
  const auto circle = Token::read(file, warning);
  std::filesystem::remove(file);
  ASSERT_FALSE(circle);
  EXPECT_THAT(circle.error().text, HasSubstr("its links lead round in a circle"));
}

TEST_F(TokenFile, AFileThatEveryoneCanReadGivesAWarning) {
  ASSERT_TRUE(read("0123456789abcdef"));
  std::filesystem::permissions(file, std::filesystem::perms::others_read, std::filesystem::perm_options::add);
  ASSERT_TRUE(Token::read(file, warning));
  EXPECT_THAT(warning, HasSubstr("chmod o-r"));
}

TEST(Token, WithoutATokenEverybodyIsAdmitted) {
  EXPECT_FALSE(Token().needed());
  EXPECT_TRUE(Token().matches(""));
  EXPECT_TRUE(Token().matches("anything"));
}

TEST(Token, IsReadFromTheAuthorizationHeader) {
  EXPECT_EQ(bearer_token("Bearer abc"), "abc");
  EXPECT_EQ(bearer_token("bearer   abc"), "abc");
  for (const char* none : {"", "Bearer", "Bearer ", "Bearer   ", "Basic abc", "Bearerabc"})
    EXPECT_EQ(bearer_token(none), "") << none;
}

}  // namespace
}  // namespace sonar
