#include "core/text/file_kind.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sonar::text {
namespace {

using namespace std::string_view_literals;
using ::testing::HasSubstr;

TEST(FileKind, NamesWhatADownloadMayBeInstead) {
  EXPECT_THAT(unusable_kind("\x1f\x8b\x08\0\0"sv, FileUse::height_map), HasSubstr("gzip; unpack it"));
  EXPECT_THAT(unusable_kind("PK\x03\x04"sv, FileUse::height_map), HasSubstr("zip archive"));
  EXPECT_THAT(unusable_kind("\n <!DOCTYPE html><html>"sv, FileUse::height_map), HasSubstr("is a web page"));
  EXPECT_THAT(unusable_kind("<HTML>"sv, FileUse::height_map), HasSubstr("is a web page"));
  EXPECT_THAT(unusable_kind("version https://git-lfs.github.com/spec/v1\noid sha256:1\n"sv, FileUse::height_map),
              HasSubstr("git lfs pull"));
  EXPECT_THAT(unusable_kind("\x89HDF\r\n\x1a\n"sv, FileUse::height_map), HasSubstr("gdal_translate"));
  EXPECT_THAT(unusable_kind("\xff\xfet\0"sv, FileUse::height_map), HasSubstr("UTF-16"));
  for (const std::string_view usable :
       {""sv, "12345"sv, "12345 6 7"sv, "123456L"sv, "# .PC"sv, "ncols 4"sv, "v 0 0 0"sv, "II*\0"sv, "II*\0\x02I\0\0"sv,
        "MM\0*\x02I\0\0"sv, "\xEF\xBB\xBFncols 4"sv, "<COLLADA>"sv, "PKD"sv, "solid"sv})
    EXPECT_EQ(unusable_kind(usable, FileUse::height_map), "") << usable;
}

TEST(FileKind, NamesDataOfSurveys) {
  EXPECT_THAT(unusable_kind("LASF\0\0"sv, FileUse::height_map),
              HasSubstr("cloud of points, not a surface; make a grid of it: pdal translate"));
  EXPECT_THAT(unusable_kind("ASTM-E57\x01"sv, FileUse::height_map), HasSubstr("cloud of points"));
  EXPECT_THAT(unusable_kind("# .PCD v0.7 - Point Cloud Data"sv, FileUse::height_map), HasSubstr("cloud of points"));
  EXPECT_THAT(unusable_kind("\x89HDF\r\n\x1a\n"sv, FileUse::height_map), HasSubstr("BAG, S-102"));
  EXPECT_THAT(unusable_kind("\0\0\x27\x0a\0\0"sv, FileUse::height_map), HasSubstr("gdal_grid"));
  EXPECT_THAT(unusable_kind("015763LE1 0900084   "sv, FileUse::height_map), HasSubstr("sea chart (S-57)"));
  EXPECT_THAT(unusable_kind("\0\0\0\x14\0\0\0\x01GSF-v03.09\0"sv, FileUse::height_map), HasSubstr("mbgrid"));
  EXPECT_THAT(unusable_kind("\x80\0\0\0#IIP\0"sv, FileUse::height_map), HasSubstr("pings of a multibeam"));
  EXPECT_THAT(unusable_kind("\x10\x01\0\0\x02I\x5c\x08"sv, FileUse::height_map), HasSubstr("pings of a multibeam"));
}

TEST(FileKind, AdvisesOnlyWhatFitsTheUse) {
  EXPECT_EQ(unusable_kind("\xff\xd8\xff"sv, FileUse::mesh), "is a JPEG picture");
  EXPECT_EQ(unusable_kind("\xff\xd8\xff"sv, FileUse::poses), "is a JPEG picture");
  EXPECT_THAT(unusable_kind("\xff\xd8\xff"sv, FileUse::height_map), HasSubstr("needs PNG"));
  EXPECT_EQ(unusable_kind("Kaydara FBX"sv, FileUse::height_map), "is FBX");
  EXPECT_THAT(unusable_kind("Kaydara FBX"sv, FileUse::mesh), HasSubstr("export it as OBJ"));
  EXPECT_EQ(unusable_kind("LASF"sv, FileUse::poses), "is a cloud of points, not a surface");
  EXPECT_THAT(unusable_kind("LASF"sv, FileUse::mesh), HasSubstr("pdal translate"));
  EXPECT_EQ(unusable_kind("015763LE1"sv, FileUse::mesh), "is a sea chart (S-57), without a grid");
  EXPECT_THAT(unusable_kind("BZh9"sv, FileUse::poses), HasSubstr("bunzip2"));
}

}  // namespace
}  // namespace sonar::text
