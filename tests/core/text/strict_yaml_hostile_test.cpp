// Hostile text: bombs, wrong encodings, broken syntax, and every mutation of a good file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "core/base/memory_left.hpp"
#include "core/base/random.hpp"
#include "core/text/strict_yaml.hpp"
#include "tests/memory_limit.hpp"

namespace sonar::text {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string refusal(std::string_view text, const YamlLimits& limits = {}) {
  auto d = parse_yaml(text, "f.yaml", limits);
  return d ? "accepted" : d.error().text;
}

TEST(StrictYamlHostile, WrongYamlIsRefused) {
  EXPECT_EQ(refusal("a: 1\nb: 2\na: 3"), "f.yaml:3:1: a: key given twice; keep one");
  EXPECT_EQ(refusal("x:\n  - {k: 1, k: 2}"), "f.yaml:2:12: x[0].k: key given twice; keep one");
  EXPECT_THAT(refusal("a: &x 1\nb: *x"), HasSubstr("a: anchors are not read here"));
  EXPECT_THAT(refusal("a: !!int 1"), HasSubstr("tags are not read here"));
  EXPECT_THAT(refusal("? [a]\n: 1"), HasSubstr("a key must be a plain word"));
  EXPECT_THAT(refusal(": 1"), HasSubstr("a key is missing before the colon"));
  EXPECT_THAT(refusal("a: 1\n---\nb: 1"), HasSubstr("a second document"));
  EXPECT_EQ(refusal(""), "f.yaml:1:1: the file is empty");
  EXPECT_EQ(refusal("# nothing\n"), "f.yaml:1:1: the file is empty");
  EXPECT_THAT(refusal("a: [1, 2"), StartsWith("f.yaml:1:"));
  EXPECT_THAT(refusal("a: [1, 2"), HasSubstr("not valid YAML"));
  EXPECT_THAT(refusal("a: b: c"), HasSubstr("not valid YAML"));
  EXPECT_THAT(refusal("\ta: 1"), StartsWith("f.yaml:1:"));
  EXPECT_THAT(refusal(std::string_view("a: \0", 4)), HasSubstr("f.yaml:1:4: a control character"));
  EXPECT_THAT(refusal("\xFF\xFE"
                      "a"),
              HasSubstr("not UTF-8"));
  // Latin-1, an overlong form and half a character. In status and metrics, readers would refuse them.
  for (const char* text : {"a: 1\nb: r\xf6v", "a: 1\nb: r\xc0\xafv", "a: 1\nb: r\xe2\x82"})
    EXPECT_EQ(refusal(text), "f.yaml:2:5: not UTF-8; save the file as UTF-8");
  EXPECT_TRUE(parse_yaml("\xef\xbb\xbf# \xe2\x82\xac\na: r\xc3\xb6v", "f.yaml"));
}

TEST(StrictYamlHostile, ARootThatIsNotAMapIsReported) {
  for (const char* text : {"[1]", "word", "- a"}) {
    auto d = parse_yaml(text, "f.yaml");
    ASSERT_TRUE(d);
    d->root();
    ASSERT_TRUE(d->finish());
    EXPECT_THAT(d->finish()->text, HasSubstr("must be a map of keys and values, found")) << text;
  }
}

TEST(StrictYamlHostile, LimitsHold) {
  EXPECT_THAT(refusal("a: 123456", {.max_bytes = 4}), HasSubstr("the file has 9 bytes, at most 4 are read"));
  EXPECT_THAT(refusal("a: [1,2,3,4,5,6]", {.max_nodes = 5}), HasSubstr("more than 5 values"));
  std::string deep = "a: ";
  for (int i = 0; i < 60; ++i) deep += "[";
  for (int i = 0; i < 60; ++i) deep += "]";
  EXPECT_THAT(refusal(deep), HasSubstr("nested deeper than 24 levels"));
  EXPECT_THAT(refusal("a: 1\nb: " + std::string(100000, '[')), HasSubstr(":2:260: more than 256 brackets"));
  std::string block;
  for (int i = 0; i < 300; ++i) block += std::string(static_cast<std::size_t>(i), ' ') + "k:\n";
  EXPECT_THAT(refusal(block), HasSubstr("nested deeper than 24 levels"));
  std::string dashes;
  for (int i = 0; i < 5000; ++i) dashes += "- ";
  EXPECT_THAT(refusal(dashes), HasSubstr("nested deeper than 24 levels"));
}

TEST(StrictYamlHostile, AnAliasBombIsRefusedAtItsFirstAnchor) {
  EXPECT_THAT(refusal("a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]"), HasSubstr("anchors are not read here"));
}

TEST(StrictYamlHostile, ManyKeysAreCheckedInLittleTime) {
  std::string text;
  for (int i = 0; i < 60000; ++i) text.append("k").append(std::to_string(i)).append(": 1\n");
  auto d = parse_yaml(text, "f.yaml");
  ASSERT_TRUE(d);
  Map m = d->root();
  m.optional("k1").number();
  EXPECT_TRUE(d->finish());
}

// Reads all values, as configurations and scenes do.
void read_all(const Node& n, int depth = 0) {
  if (n.is_map()) {
    Map m = n.map();
    m.required("name").text_or("");
    for (auto& [key, child] : m.entries()) read_all(child, depth + 1);
  } else if (n.is_sequence()) {
    n.numbers<3>();
    for (const Node& child : n.items()) read_all(child, depth + 1);
  } else {
    n.number();
    n.integer(0, 10);
    n.boolean();
    n.choice<int>({{"a", 1}, {"b", 2}});
  }
}

TEST(StrictYamlHostile, TruncationsAndMutationsGiveAValueOrAnError) {
  const std::string good =
      "name: \"t\\u00e9st\"\nlist: [1, 2.5, {x: y, z: ~}]\nblock: |\n  text\n  more\n"
      "deep:\n  - a: 'q'\n    b: >-\n      folded\n  - !x b\n? c\n: d\n# end\n";
  const auto check = [](const std::string& text) {
    auto d = parse_yaml(text, "f.yaml");
    if (!d) {
      EXPECT_THAT(d.error().text, StartsWith("f.yaml:"));
      return;
    }
    for (auto& [key, child] : d->root().entries()) read_all(child);
    if (const auto e = d->finish()) {
      EXPECT_THAT(e->text, StartsWith("f.yaml:"));
    }
  };
  for (std::size_t n = 0; n <= good.size(); ++n) check(good.substr(0, n));
  constexpr std::string_view alphabet = "[]{}:,-?&*!|>'\"%@`#\n\t ~0a\\\xff\x80";
  for (std::uint32_t i = 0; i < 4000; ++i) {
    const Random4 r = philox(i, 0, 0, 0, 1, 2);
    std::string bad = good;
    bad[r.v[0] % bad.size()] = alphabet[r.v[1] % alphabet.size()];
    if (r.v[3] & 1) bad.insert(r.v[2] % bad.size(), 1, alphabet[(r.v[3] >> 8) % alphabet.size()]);
    check(bad);
  }
}

/// Returns the error of a child process whose limit of addresses leaves room for 8 MiB; "" if there is none.
std::string error_with_little_memory(const std::function<Result<Document>()>& read) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    const rlim_t bytes = address_space_bytes().value() + (std::uint64_t{8} << 20);
    const rlimit limit{bytes, bytes};
    if (::setrlimit(RLIMIT_AS, &limit) != 0) ::_exit(2);
    const auto document = [&]() noexcept { return read(); }();  // GoogleTest would catch what it throws
    const std::string text = document || document.error().kind != ErrorKind::unavailable ? "" : document.error().text;
    ::_exit(::write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size()) ? 0 : 1);
  }
  ::close(ends[1]);
  std::string text(1000, '\0');
  text.resize(static_cast<std::size_t>(std::max(::read(ends[0], text.data(), text.size()), ssize_t{0})));
  ::close(ends[0]);
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  return text;
}

TEST(StrictYamlHostile, ALackOfMemoryIsNoMistakeOfTheFile) {
  if (!test::memory_is_limited()) GTEST_SKIP() << "sanitizers and emulated processors keep no limit of addresses";
  const std::string cure = ": not enough memory to read it; raise the limits of memory (ulimit -v, LimitAS=, MemoryMax=)";
  std::string text = "a: [0";
  for (int i = 0; i < 300000; ++i) text += ",0";
  text += "]";
  EXPECT_EQ(error_with_little_memory([&] { return parse_yaml(text, "f.yaml"); }), "f.yaml" + cure) << "for a part of the tree";
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "large.yaml";
  std::ofstream(file).close();
  constexpr std::size_t bytes = std::size_t{64} << 20;
  std::filesystem::resize_file(file, bytes);
  EXPECT_EQ(error_with_little_memory([&] { return parse_yaml_file(file, {.max_bytes = bytes}); }), file.string() + cure);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace sonar::text
