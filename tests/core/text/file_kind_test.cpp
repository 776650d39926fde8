#include "core/text/file_kind.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sonar::text {
namespace {

using namespace std::string_view_literals;
using ::testing::HasSubstr;

TEST(FileKind, NamesWhatADownloadMayBeInstead) {
  EXPECT_THAT(unusable_kind("\x1f\x8b\x08\0\0"sv), HasSubstr("gzip; unpack it"));
  EXPECT_THAT(unusable_kind("PK\x03\x04"sv), HasSubstr("zip archive"));
  EXPECT_THAT(unusable_kind("\n <!DOCTYPE html><html>"sv), HasSubstr("is a web page"));
  EXPECT_THAT(unusable_kind("<HTML>"sv), HasSubstr("is a web page"));
  EXPECT_THAT(unusable_kind("version https://git-lfs.github.com/spec/v1\noid sha256:1\n"sv), HasSubstr("git lfs pull"));
  EXPECT_THAT(unusable_kind("\x89HDF\r\n\x1a\n"sv), HasSubstr("gdal_translate"));
  EXPECT_THAT(unusable_kind("\xff\xfet\0"sv), HasSubstr("UTF-16"));
  for (const std::string_view usable :
       {""sv, "ncols 4"sv, "v 0 0 0"sv, "II*\0"sv, "\xEF\xBB\xBFncols 4"sv, "<COLLADA>"sv, "PKD"sv, "solid"sv})
    EXPECT_EQ(unusable_kind(usable), "") << usable;
}

}  // namespace
}  // namespace sonar::text
