#include "core/text/file_kind.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "core/base/letters.hpp"

namespace sonar::text {
namespace {

using namespace std::string_view_literals;

struct Kind {
  std::string_view begins, says;
};

constexpr std::array<Kind, 16> kinds{
    {{"\x1f\x8b"sv, "is compressed with gzip; unpack it (gunzip)"},
     {"PK\x03\x04"sv, "is a zip archive; unpack it (unzip)"},
     {"BZh"sv, "is compressed with bzip2; unpack it (bunzip2)"},
     {"\xfd"
      "7zXZ"sv,
      "is compressed with xz; unpack it (unxz)"},
     {"(\xb5/\xfd"sv, "is compressed with Zstandard; unpack it (unzstd)"},
     {"7z\xbc\xaf"sv, "is a 7z archive; unpack it"},
     {"\x89HDF"sv, "is HDF5 (NetCDF-4 and BAG are, too); convert it: gdal_translate -of GTiff IN OUT.tif"},
     {"CDF\x01"sv, "is NetCDF; convert it: gdal_translate -of GTiff IN OUT.tif"},
     {"CDF\x02"sv, "is NetCDF; convert it: gdal_translate -of GTiff IN OUT.tif"},
     {"CDF\x05"sv, "is NetCDF; convert it: gdal_translate -of GTiff IN OUT.tif"},
     {"LASF"sv, "is a cloud of points (LAS, LAZ); make a grid or a mesh of it"},
     {"%PDF"sv, "is a PDF document"},
     {"\xff\xfe"sv, "is text in UTF-16; save it as UTF-8"},
     {"\xfe\xff"sv, "is text in UTF-16; save it as UTF-8"},
     {"version https://git-lfs"sv, "is a pointer of Git LFS, not the file itself; fetch that: git lfs pull"},
     {"Kaydara FBX"sv, "is FBX; export it as OBJ, STL, PLY, glTF, GLB or DAE"}}};

}  // namespace

std::string_view unusable_kind(std::string_view begin) {
  for (const Kind& kind : kinds)
    if (begin.starts_with(kind.begins)) return kind.says;
  std::string word = small_letters(begin.substr(0, kind_bytes));
  word.erase(0, std::min(word.find_first_not_of(" \t\r\n"), word.size()));
  if (word.starts_with("<!doctype html") || word.starts_with("<html"))
    return "is a web page, not the file itself; was the download refused? Fetch it again";
  return {};
}

}  // namespace sonar::text
