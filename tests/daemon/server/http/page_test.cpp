// The page's files as answers to requests, and the headers of these answers.
#include "daemon/server/http/page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace sonar {
namespace {

using testing::HasSubstr;

constexpr unsigned char html[] = {1, 2, 3}, script[] = {4, 5};
constexpr PageFile files[] = {{"/", "text/html; charset=utf-8", "aa", html},
                              {"/app-0123.js", "text/javascript; charset=utf-8", "bb", script}};

constexpr const char* browser = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";

std::string header(const HttpAnswer& answer, const std::string& name) {
  for (const auto& [key, value] : answer.headers)
    if (key == name) return value;
  return {};
}

TEST(Page, AnswersBrowsersOnly) {
  const auto page = page_answer({"/", browser, "gzip, deflate, br", ""}, files);
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200u);
  EXPECT_EQ(page->type, "text/html; charset=utf-8");
  EXPECT_EQ(page->body, "\x01\x02\x03");
  EXPECT_EQ(header(*page, "Content-Encoding"), "gzip");
  EXPECT_EQ(header(*page, "Cache-Control"), "no-cache");
  EXPECT_THAT(header(*page, "Vary"), HasSubstr("Accept"));
  for (const char* accept : {"*/*", "", "application/json", "text/html;q=0"})
    EXPECT_FALSE(page_answer({"/", accept, "gzip", ""}, files)) << accept;
}

TEST(Page, BrowsersMayKeepHashedFilesForEver) {
  const auto file = page_answer({"/app-0123.js", "*/*", "GZIP", ""}, files);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->body, "\x04\x05");
  EXPECT_THAT(header(*file, "Cache-Control"), HasSubstr("immutable"));
  EXPECT_FALSE(page_answer({"/app-9999.js", "*/*", "gzip", ""}, files));
  EXPECT_FALSE(page_answer({"/healthz", browser, "gzip", ""}, files));
}

TEST(Page, AllowsTheBrowserOnlyOurFiles) {
  const auto page = page_answer({"/", browser, "gzip", ""}, files);
  EXPECT_EQ(header(*page, "Content-Security-Policy"),
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
  EXPECT_EQ(header(*page, "Referrer-Policy"), "no-referrer");
  EXPECT_EQ(header(*page, "Cross-Origin-Opener-Policy"), "same-origin");
  EXPECT_EQ(header(*page, "Cross-Origin-Resource-Policy"), "same-origin");
}

TEST(Page, IsNotSentToABrowserThatHasItsHash) {
  for (const char* known : {"\"aa\"", "\"x\", W/\"aa\"", "*"}) {
    const auto page = page_answer({"/", browser, "gzip", known}, files);
    ASSERT_TRUE(page);
    EXPECT_EQ(page->status, 304u) << known;
    EXPECT_EQ(page->body, "");
    EXPECT_EQ(header(*page, "ETag"), "\"aa\"");
    EXPECT_EQ(header(*page, "Content-Encoding"), "");
  }
  EXPECT_EQ(page_answer({"/", browser, "gzip", "\"old\""}, files)->status, 200u);
}

TEST(Page, ClientsWithoutGzipGetAnError) {
  for (const char* encoding : {"", "identity", "gzip;q=0", "br"}) {
    const auto page = page_answer({"/", browser, encoding, ""}, files);
    ASSERT_TRUE(page);
    EXPECT_EQ(page->status, 406u) << encoding;
    EXPECT_THAT(page->body, HasSubstr("gzip"));
  }
}

TEST(Page, FitsTheBudgetOfBytes) {
  std::size_t bytes = 0;
  for (const PageFile& file : page_files()) {
    bytes += file.bytes.size();
    EXPECT_EQ(file.bytes[0], 0x1f) << file.path;
    EXPECT_EQ(file.bytes[1], 0x8b) << file.path;
  }
  EXPECT_LE(page_files().size(), 6u);
  EXPECT_LE(bytes, 190'000u);
  if (page_files().empty()) GTEST_SKIP() << "this build has no page";
}

}  // namespace
}  // namespace sonar
