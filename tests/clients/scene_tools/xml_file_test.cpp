#include <gmock/gmock.h>

#include "clients/scene_tools/xml_file.hpp"

namespace sonar::scene_tools {
namespace {

TEST(XmlFile, ElementsHaveTheirLinesAndAbsentOnesAreEmpty) {
  const auto file = parse_xml("<a>\n  <b c=' d '> text\n</b></a>", "x.sdf", "x");
  ASSERT_TRUE(file);
  EXPECT_EQ((*file)->elements, 2u);
  const Element b = (*file)->root().child("b");
  EXPECT_EQ(b.place().text(), "x.sdf:2");
  EXPECT_EQ(b.text(), "text");
  EXPECT_EQ(b.attribute("c"), "d");
  const Element none = b.child("none").child("deeper");
  EXPECT_FALSE(none);
  EXPECT_EQ(none.text(), "");
  EXPECT_EQ(none.attribute("x"), "");
  EXPECT_TRUE(none.children().empty());
}

TEST(XmlFile, RefusesFilesThatAreTooLargeOrNotText) {
  EXPECT_THAT(parse_xml(std::string(max_xml_bytes + 1, ' '), "x", "x").error().text, ::testing::HasSubstr("16 MiB"));
  EXPECT_THAT(parse_xml(std::string("<a>\0</a>", 8), "x", "x").error().text, ::testing::HasSubstr("not a text file"));
  EXPECT_THAT(parse_xml("<!-- nothing -->", "x", "x").error().text, ::testing::HasSubstr("x:1: "));
}

TEST(XmlFile, NumbersAreCountedAndChecked) {
  Findings findings;
  EXPECT_THAT(read_numbers(" 1 -2e1\n+3 ", 3, {}, "p", findings), ::testing::ElementsAre(1, -20, 3));
  EXPECT_FALSE(findings.failed());
  for (const char* wrong : {"1 2", "1 2 3 4", "1 2 3x", "1 2 inf", "1 2 1e300", "1,2,3"}) {
    Findings these;
    EXPECT_THAT(read_numbers(wrong, 3, {}, "p", these), ::testing::ElementsAre(0, 0, 0)) << wrong;
    EXPECT_TRUE(these.failed()) << wrong;
  }
}

TEST(XmlFile, PlainTextIsOneLineOfUtf8) {
  EXPECT_EQ(plain("Gebäude 漁船"), "Gebäude 漁船");
  EXPECT_EQ(plain("a\nb\tc\x7f"), "a_b_c_");
  EXPECT_EQ(plain("\xff\xc3"), "__");
  EXPECT_EQ(plain("\xe2\x80\xa8 \xc2\x85"), "___ __");  // ends of lines outside ASCII
  EXPECT_EQ(plain(std::string(100, 'x')).size(), 64u);
  EXPECT_EQ(plain("漁船", 4), "漁");
}

}  // namespace
}  // namespace sonar::scene_tools
