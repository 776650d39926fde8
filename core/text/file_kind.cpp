#include "core/text/file_kind.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "core/base/letters.hpp"

namespace sonar::text {
namespace {

using namespace std::string_view_literals;

enum class Advice { for_all, for_surfaces, for_height_maps, for_meshes };

struct Kind {
  std::size_t at;
  std::string_view bytes, what, advice = {};
  Advice fits = Advice::for_all;
};

constexpr std::string_view points = "is a cloud of points, not a surface",
                           soundings = "holds pings of a multibeam sonar, not a grid",
                           as_grid =
                               "make a grid of it: pdal translate IN OUT.tif --writers.gdal.resolution=1 "
                               "--writers.gdal.output_type=mean",
                           as_tiff = "convert it: gdal_translate -of GTiff IN OUT.tif", utf8 = "save it as UTF-8";

constexpr std::array<Kind, 23> kinds{
    {{0, "\x1f\x8b"sv, "is compressed with gzip", "unpack it (gunzip)"},
     {0, "PK\x03\x04"sv, "is a zip archive", "unpack it (unzip)"},
     {0, "BZh"sv, "is compressed with bzip2", "unpack it (bunzip2)"},
     {0,
      "\xfd"
      "7zXZ"sv,
      "is compressed with xz", "unpack it (unxz)"},
     {0, "(\xb5/\xfd"sv, "is compressed with Zstandard", "unpack it (unzstd)"},
     {0, "7z\xbc\xaf"sv, "is a 7z archive", "unpack it"},
     {0, "\x89HDF"sv, "is HDF5 (as BAG, S-102 and NetCDF-4 are)", as_tiff, Advice::for_height_maps},
     {0, "CDF\x01"sv, "is NetCDF", as_tiff, Advice::for_height_maps},
     {0, "CDF\x02"sv, "is NetCDF", as_tiff, Advice::for_height_maps},
     {0, "CDF\x05"sv, "is NetCDF", as_tiff, Advice::for_height_maps},
     {0, "LASF"sv, points, as_grid, Advice::for_surfaces},
     {0, "ASTM-E57"sv, points, as_grid, Advice::for_surfaces},
     {0, "# .PCD"sv, points, as_grid, Advice::for_surfaces},
     {0, "\0\0\x27\x0a"sv, "is a shapefile, of points or outlines", "make a grid of it: gdal_grid -zfield NAME IN OUT.tif",
      Advice::for_height_maps},
     {8, "GSF-v"sv, soundings, "make a grid of them (MB-System: mbgrid)", Advice::for_height_maps},
     {4, "#IIP"sv, soundings, "make a grid of them (MB-System: mbgrid)", Advice::for_height_maps},
     {2, "\0\0\x02I"sv, soundings, "make a grid of them (MB-System: mbgrid)", Advice::for_height_maps},
     {0, "\xff\xd8\xff"sv, "is a JPEG picture", "a height map needs PNG: gdal_translate -of PNG IN OUT.png",
      Advice::for_height_maps},
     {0, "%PDF"sv, "is a PDF document"},
     {0, "\xff\xfe"sv, "is text in UTF-16", utf8},
     {0, "\xfe\xff"sv, "is text in UTF-16", utf8},
     {0, "version https://git-lfs"sv, "is a pointer of Git LFS, not the file itself", "fetch that: git lfs pull"},
     {0, "Kaydara FBX"sv, "is FBX", "export it as OBJ, STL, PLY, glTF, GLB or DAE", Advice::for_meshes}}};

bool is_for(FileUse use, Advice advice) {
  switch (advice) {
    case Advice::for_all:
      return true;
    case Advice::for_surfaces:
      return use != FileUse::poses;
    case Advice::for_height_maps:
      return use == FileUse::height_map;
    case Advice::for_meshes:
      return use == FileUse::mesh;
  }
  return false;
}

std::string text_of(const Kind& kind, FileUse use) {
  std::string text(kind.what);
  if (!kind.advice.empty() && is_for(use, kind.fits)) text.append("; ").append(kind.advice);
  return text;
}

/// Charts of IHO S-57 begin with six digits (the length and the level of the first record) and a fixed word.
bool is_sea_chart(std::string_view begin) {
  constexpr std::size_t digits = 6;
  return begin.find_first_not_of("0123456789") == digits && begin.substr(digits).starts_with("LE1");
}

}  // namespace

std::string unusable_kind(std::string_view begin, FileUse use) {
  for (const Kind& kind : kinds)
    if (begin.substr(std::min(kind.at, begin.size())).starts_with(kind.bytes)) return text_of(kind, use);
  if (is_sea_chart(begin))
    return text_of(
        {0, {}, "is a sea chart (S-57), without a grid", "use a grid of the area (GeoTIFF, BAG, S-102)", Advice::for_height_maps},
        use);
  std::string word = small_letters(begin.substr(0, kind_bytes));
  word.erase(0, std::min(word.find_first_not_of(" \t\r\n"), word.size()));
  if (word.starts_with("<!doctype html") || word.starts_with("<html"))
    return "is a web page, not the file itself; was the download refused? Fetch it again";
  return {};
}

}  // namespace sonar::text
