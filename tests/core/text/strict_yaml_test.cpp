// Reading values: accepted and refused values, and the exact error texts.
#include "core/text/strict_yaml.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>

#include "core/text/decimal.hpp"

namespace sonar::text {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Document parsed(std::string_view text) {
  auto d = parse_yaml(text, "f.yaml");
  if (!d) throw std::runtime_error(d.error().text);
  return std::move(*d);
}

// The error text of a reader, or "ok".
std::string read(std::string_view text, const std::function<void(Map)>& reader) {
  const Document d = parsed(text);
  reader(d.root());
  const auto error = d.finish();
  return error ? error->text : "ok";
}

std::string read_number(std::string_view scalar, Range range = {}) {
  return read("a: " + std::string(scalar), [&](Map m) { m.required("a").number(range); });
}
double number_of(std::string_view scalar, Range range = {}) {
  const Document d = parsed("a: " + std::string(scalar));
  Map m = d.root();
  const double v = m.required("a").number(range);
  EXPECT_FALSE(d.finish()) << d.finish()->text;
  return v;
}

TEST(StrictYaml, ReadsEveryKindOfValue) {
  const Document d = parsed(R"(
name: harbour            # comment
count: -3
big: 18446744073709551615
ratio: 2.5e-1
on: true
off: false
where: [1, -2.5, 3]
words: [a, "b c", 012]
kind: hold
inner: {x: 1}
)");
  Map m = d.root();
  EXPECT_EQ(m.required("name").text(), "harbour");
  EXPECT_EQ(m.required("count").integer(-10, 10), -3);
  EXPECT_EQ(m.required("big").unsigned_integer_or(0), 18446744073709551615u);
  EXPECT_DOUBLE_EQ(m.required("ratio").number(), 0.25);
  EXPECT_TRUE(m.required("on").boolean());
  EXPECT_FALSE(m.required("off").boolean_or(true));
  EXPECT_EQ(m.required("where").numbers<3>(), (std::array<double, 3>{1, -2.5, 3}));
  EXPECT_EQ(m.required("words").texts(), (std::vector<std::string>{"a", "b c", "012"}));
  EXPECT_EQ(m.required("kind").choice<int>({{"blank", 7}, {"hold", 8}}), 8);
  EXPECT_EQ(m.required("inner").map().required("x").integer(0, 1), 1);
  EXPECT_FALSE(d.finish()) << d.finish()->text;
}

TEST(StrictYaml, AbsentValuesTakeTheFallback) {
  const Document d = parsed("a: 1");
  Map m = d.root();
  EXPECT_EQ(m.optional("a").number_or(5), 1);
  EXPECT_EQ(m.optional("b").number_or(5), 5);
  EXPECT_EQ(m.optional("c").integer_or(6, 0, 9), 6);
  EXPECT_EQ(m.optional("d").text_or("x"), "x");
  EXPECT_TRUE(m.optional("e").boolean_or(true));
  EXPECT_EQ(m.optional("f").unsigned_integer_or(9), 9u);
  EXPECT_EQ((m.optional("g").choice_or<int>(4, {{"q", 1}})), 4);
  EXPECT_EQ(m.optional("h").numbers_or<2>({1, 2}), (std::array<double, 2>{1, 2}));
  EXPECT_TRUE(m.optional("i").items().empty());
  Map inner = m.optional("j").map();
  EXPECT_FALSE(inner.required("k").present());  // required inside a map that may be absent
  EXPECT_FALSE(d.finish()) << d.finish()->text;
}

TEST(StrictYaml, NumbersAreDecimalOnly) {
  EXPECT_DOUBLE_EQ(number_of("12"), 12);
  EXPECT_DOUBLE_EQ(number_of("+1.5"), 1.5);
  EXPECT_DOUBLE_EQ(number_of("-0"), 0);
  EXPECT_DOUBLE_EQ(number_of(".5"), 0.5);
  EXPECT_DOUBLE_EQ(number_of("5."), 5);
  EXPECT_DOUBLE_EQ(number_of("1E3"), 1000);
  EXPECT_EQ(read_number("012"), "f.yaml:1:4: a: must be a finite decimal number, found \"012\"; remove the leading zero");
  EXPECT_EQ(read_number("0x10"), "f.yaml:1:4: a: must be a finite decimal number, found \"0x10\"; write it in decimal");
  EXPECT_EQ(read_number("1_000"), "f.yaml:1:4: a: must be a finite decimal number, found \"1_000\"; write it without _");
  EXPECT_EQ(read_number("1,5"), "f.yaml:1:4: a: must be a finite decimal number, found \"1,5\"; the decimal sign is a point");
  for (const char* bad : {".nan", "nan", "NaN", ".inf", "inf", "-inf", "1e999", "1e", "e5", "1.2.3", "--1", "+-1", "1 m", "0b1",
                          "\"10\"", "true", "12:30", "''"}) {
    EXPECT_THAT(read_number(bad), HasSubstr("must be a finite decimal number, found ")) << bad;
  }
  EXPECT_EQ(read_number(""), "f.yaml:1:1: a: must be a number, found nothing");
  EXPECT_EQ(read_number("~"), "f.yaml:1:1: a: must be a number, found nothing");
  EXPECT_EQ(read_number("[1]"), "f.yaml:1:4: a: must be a number, found a list");
  EXPECT_EQ(read_number("{b: 1}"), "f.yaml:1:4: a: must be a number, found a map");
}

TEST(StrictYaml, RangesAreCheckedAndReported) {
  EXPECT_EQ(read_number("50", Range::between(1, 40)), "f.yaml:1:4: a: must be between 1 and 40, found 50");
  EXPECT_EQ(read_number("-1", Range::at_least(0)), "f.yaml:1:4: a: must be at least 0, found -1");
  EXPECT_EQ(read_number("0", Range::above(0)), "f.yaml:1:4: a: must be above 0, found 0");
  EXPECT_EQ(read_number("9", Range::at_most(8.5)), "f.yaml:1:4: a: must be at most 8.5, found 9");
  EXPECT_EQ(read_number("40", Range::between(1, 40)), "ok");
  Range open;
  open.infinity = true;
  EXPECT_TRUE(std::isinf(number_of(".inf", open)));
  EXPECT_TRUE(std::isinf(number_of("inf", open)));
  Range bounded = Range::between(0, 5);
  bounded.infinity = true;
  EXPECT_THAT(read_number("inf", bounded), HasSubstr("must be between 0 and 5"));
  EXPECT_THAT(read_number(".nan", open), HasSubstr("must be a finite decimal number"));
}

TEST(StrictYaml, WholeNumbersHaveLimits) {
  const auto whole = [](std::string_view s) {
    return read("a: " + std::string(s), [](Map m) { m.required("a").integer(-5, 100); });
  };
  EXPECT_EQ(whole("100"), "ok");
  EXPECT_EQ(whole("+7"), "ok");
  EXPECT_EQ(whole("101"), "f.yaml:1:4: a: must be between -5 and 100, found 101");
  EXPECT_EQ(whole("99999999999999999999"), "f.yaml:1:4: a: must be between -5 and 100, found 99999999999999999999");
  EXPECT_EQ(whole("1.0"), "f.yaml:1:4: a: must be a whole decimal number, found \"1.0\"");
  EXPECT_EQ(whole("010"), "f.yaml:1:4: a: must be a whole decimal number, found \"010\"; remove the leading zero");
  EXPECT_EQ(whole("-+1"), "f.yaml:1:4: a: must be a whole decimal number, found \"-+1\"");
  EXPECT_THAT(read("a: -1", [](Map m) { m.required("a").unsigned_integer_or(0); }), HasSubstr("must be a whole decimal number"));
  EXPECT_THAT(read("a: 18446744073709551616", [](Map m) { m.required("a").unsigned_integer_or(0); }), HasSubstr("between 0 and"));
}

TEST(StrictYaml, BooleansAreTrueOrFalse) {
  for (const char* bad : {"yes", "on", "True", "1", "\"true\"", "no"}) {
    EXPECT_THAT(read("a: " + std::string(bad), [](Map m) { m.required("a").boolean(); }),
                StartsWith("f.yaml:1:4: a: must be true or false, found "))
        << bad;
  }
}

TEST(StrictYaml, ChoicesNameTheNearest) {
  const auto choose = [](std::string_view s) {
    return read("a: " + std::string(s), [](Map m) { m.required("a").choice<int>({{"hold", 1}, {"blank", 2}, {"stop", 3}}); });
  };
  EXPECT_EQ(choose("blank"), "ok");
  EXPECT_EQ(choose("blnak"), "f.yaml:1:4: a: unknown value \"blnak\"; did you mean \"blank\"?");
  EXPECT_EQ(choose("zero"), "f.yaml:1:4: a: unknown value \"zero\"; valid values: hold, blank, stop");
  EXPECT_EQ(choose("[hold]"), "f.yaml:1:4: a: must be one of hold, blank, stop, found a list");
}

TEST(StrictYaml, ListsHaveTheRightLength) {
  const auto three = [](std::string_view s) {
    return read("a: " + std::string(s), [](Map m) { m.required("a").numbers<3>(Range::at_least(0)); });
  };
  EXPECT_EQ(three("[1, 2, 3]"), "ok");
  EXPECT_EQ(three("[1, 2]"), "f.yaml:1:4: a: must be a list of 3 numbers, found 2 of them");
  EXPECT_EQ(three("5"), "f.yaml:1:4: a: must be a list of 3 numbers, found \"5\"");
  EXPECT_EQ(three("[1, -2, 3]"), "f.yaml:1:8: a[1]: must be at least 0, found -2");
  EXPECT_EQ(three("[1, x, 3]"), "f.yaml:1:8: a[1]: must be a finite decimal number, found \"x\"");
  EXPECT_EQ(read("a: []", [](Map m) { m.required("a").items(1); }), "f.yaml:1:4: a: must have at least 1 element");
  EXPECT_EQ(read("a: [1,2,3]", [](Map m) { m.required("a").items(0, 2); }),
            "f.yaml:1:4: a: has 3 elements, at most 2 are allowed");
  EXPECT_EQ(read("a: {b: 1}", [](Map m) { m.required("a").items(); }), "f.yaml:1:4: a: must be a list, found a map");
  EXPECT_EQ(read("a: [1]", [](Map m) { m.required("a").map(); }),
            "f.yaml:1:4: a: must be a map of keys and values, found a list");
}

TEST(StrictYaml, TextsHaveLimits) {
  EXPECT_EQ(read("a: ''", [](Map m) { m.required("a").text(); }), "f.yaml:1:4: a: must not be empty");
  EXPECT_EQ(read("a: ''", [](Map m) { m.required("a").text(10, true); }), "ok");
  EXPECT_EQ(read("a: abcdef", [](Map m) { m.required("a").text(5); }), "f.yaml:1:4: a: has 6 bytes, at most 5 are allowed");
}

// docs/scenes.md promises this form of the error text.
TEST(StrictYaml, UnknownKeyNamesTheNearest) {
  const std::string text = "sonars:\n  - name: front\n    rang: 10\n";
  const auto reader = [](Map m) {
    for (const Node& n : m.required("sonars").items()) {
      Map sonar = n.map();
      sonar.required("name").text();
      sonar.optional("range").number();
    }
  };
  EXPECT_EQ(read(text, reader), "f.yaml:3:5: sonars[0].rang: unknown key; did you mean \"range\"?");
  EXPECT_EQ(read("sonars: []\ncolour: red", reader), "f.yaml:2:1: colour: unknown key; valid keys: sonars");
}

TEST(StrictYaml, AMissingKeyIsReportedUnlessATypingErrorExplainsIt) {
  EXPECT_EQ(read("b: 1", [](Map m) { m.optional("b").number(), m.required("scene").text(); }),
            "f.yaml:1:1: scene: required key is missing");
  EXPECT_EQ(read("b: {}", [](Map m) { m.optional("b").map().required("scene").text(); }),
            "f.yaml:1:4: b.scene: required key is missing");
  EXPECT_EQ(read("x: 1\nscnee: a", [](Map m) { m.required("scene").text(); }),
            "f.yaml:2:1: scnee: unknown key; did you mean \"scene\"?");
}

TEST(StrictYaml, AReaderThatRefusesAMissingValueHidesNeitherTheMissingKeyNorTheSlip) {
  const auto reader = [](Map m) {
    const Node scene = m.required("scene");
    if (scene.text().empty()) scene.fail("no such file");
  };
  EXPECT_EQ(read("{}", reader), "f.yaml:1:1: scene: required key is missing");
  EXPECT_EQ(read("scnee: a", reader), "f.yaml:1:1: scnee: unknown key; did you mean \"scene\"?");
  EXPECT_EQ(read("{}", [](Map m) { m.optional("scene").fail("give a scene"); }), "f.yaml:1:1: scene: give a scene");
}

TEST(StrictYaml, TheFirstWrongValueWins) {
  EXPECT_EQ(read("a: x\nb: y\nc: 1", [](Map m) { m.required("a").number(), m.required("b").number(); }),
            "f.yaml:1:4: a: must be a finite decimal number, found \"x\"");
}

TEST(StrictYaml, ReadersCanFailAtAValue) {
  EXPECT_EQ(read("n: {ip: 300.1.1.1}", [](Map m) { m.required("n").map().required("ip").fail("is not an address"); }),
            "f.yaml:1:9: n.ip: is not an address");
  EXPECT_EQ(read("n: {}", [](Map m) { m.required("n").map().optional("ip").fail("is needed here"); }),
            "f.yaml:1:4: n.ip: is needed here");
}

TEST(StrictYaml, NamedEntriesAcceptAnyKey) {
  const Document d = parsed("m:\n  sand: 1\n  mud: 2\n");
  Map root = d.root();
  double sum = 0;
  for (auto& [name, node] : root.required("m").map().entries()) sum += node.number() + static_cast<double>(name.size());
  EXPECT_DOUBLE_EQ(sum, 1 + 2 + 4 + 3);
  EXPECT_FALSE(d.finish());
}

TEST(StrictYaml, AChangedCopyKeepsPositionsAndIsNotReadYet) {
  const auto document = parse_yaml("a: X1\nX: [2, {b: X, c: 'X'}]\n", "f.yaml");
  ASSERT_TRUE(document);
  document->root().optional("a").number();  // an error of the first reader
  std::vector<int> lines;
  const auto copy = document->changed([&](const std::string& text, int line) -> Result<std::string> {
    if (text.find('X') == std::string::npos) return text;
    lines.push_back(line);
    return "3" + text.substr(1);
  });
  ASSERT_TRUE(copy);
  EXPECT_EQ(lines, (std::vector{1, 2, 2, 2}));
  Map root = copy->root();
  EXPECT_EQ(root.required("a").number(), 31);
  const auto items = root.required("3").items();
  ASSERT_EQ(items.size(), 2u);
  EXPECT_EQ(items[1].map().required("b").number(), 3);
  EXPECT_FALSE(copy->error());
  items[1].map().required("c").number();
  ASSERT_TRUE(copy->error());
  EXPECT_THAT(copy->error()->text, HasSubstr("f.yaml:2:18: 3[1].c")) << "a text in quotes is no number";
  EXPECT_FALSE(
      document->changed([](const std::string&, int) -> Result<std::string> { return failure(ErrorKind::config, "no"); }));
}

TEST(StrictYaml, MapsThatWereNotOpenedAreNotSearched) {
  EXPECT_EQ(read("a: {b: 1}", [](Map m) { m.optional("a"); }), "ok");
}

TEST(StrictYaml, ErrorsHaveLocationAndPath) {
  const Document d = parsed("a:\n  - b: {c: 1}\n");
  Map m = d.root();
  const Node c = m.required("a").items()[0].map().required("b").map().required("c");
  EXPECT_EQ(c.path(), "a[0].b.c");
  EXPECT_EQ(c.location(), "f.yaml:2:12");
  EXPECT_EQ(c.key(), "c");
}

TEST(StrictYaml, FilesThatCannotBeRead) {
  const auto missing = parse_yaml_file("no/such/file.yaml");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::missing_file);
  EXPECT_EQ(missing.error().text, "no/such/file.yaml: cannot be opened: No such file or directory");
  const auto folder = parse_yaml_file(SONARD_SOURCE_DIR);
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().text, HasSubstr("is a folder, not a regular file"));
}

TEST(StrictYaml, ErrorsHaveTheRequestedKind) {
  const auto bad = parse_yaml("a: [", "s.yaml", {.error_kind = ErrorKind::bad_data});
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().kind, ErrorKind::bad_data);
  auto d = parse_yaml("a: 1", "s.yaml", {.error_kind = ErrorKind::bad_data});
  ASSERT_TRUE(d);
  d->root();
  const auto error = d->finish();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->text, "s.yaml:1:1: a: unknown key");
  EXPECT_EQ(error->kind, ErrorKind::bad_data);
}

TEST(Decimal, TheWholeTextMustBeANumber) {
  EXPECT_EQ(parse_decimal("1.25"), 1.25);
  EXPECT_EQ(parse_decimal(""), std::nullopt);
  EXPECT_EQ(parse_decimal("1 "), std::nullopt);
  EXPECT_EQ(parse_decimal("."), std::nullopt);
  EXPECT_EQ(parse_integer("-12"), -12);
  EXPECT_EQ(parse_integer("1e3"), std::nullopt);
}

}  // namespace
}  // namespace sonar::text
