#include "core/base/base64.hpp"

#include <gtest/gtest.h>

namespace sonar {
namespace {

TEST(Base64, KnownAnswers) {
  const std::pair<std::string, std::string> answers[] = {{"", ""},        {"f", "Zg=="},          {"fo", "Zm8="},
                                                         {"foo", "Zm9v"}, {"foobar", "Zm9vYmFy"}, {{"\xFB\xFF\0", 3}, "+/8A"}};
  for (const auto& [bytes, text] : answers) {
    EXPECT_EQ(base64(std::as_bytes(std::span(bytes))), text);
    EXPECT_EQ(from_base64(text), bytes);
    EXPECT_EQ(from_base64(text.substr(0, text.find('='))), bytes) << "without padding";
  }
}

TEST(Base64, OtherTextsAreRefused) {
  for (const char* text : {"A", "AAAAA", "Zm9v YmFy", "Zm-_", "Zm=v", "\xC3\xA9"})
    EXPECT_EQ(from_base64(text), std::nullopt) << text;
}

}  // namespace
}  // namespace sonar
