// Fuzzes PNG images as heights. If the first byte is p, the rest is the file; if it is P, the file's checksums are corrected
// first, so that the code after the checks is reached. Otherwise single bytes give width, height, depth, colour and interlacing;
// the scan lines follow, and this program packs them.
#include <zlib.h>

#include <cmath>
#include <string_view>
#include <vector>

#include "tests/fuzz/heights.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace {

using sonar::fuzz::Script;
using Png = std::vector<std::uint8_t>;

void put_big_endian(Png& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
}

void put_chunk(Png& out, std::string_view type, const Png& body) {
  put_big_endian(out, static_cast<std::uint32_t>(body.size()));
  const std::size_t from = out.size();
  out.insert(out.end(), type.begin(), type.end());
  out.insert(out.end(), body.begin(), body.end());
  put_big_endian(out, static_cast<std::uint32_t>(crc32(0, out.data() + from, static_cast<uInt>(out.size() - from))));
}

Png built(Script script) {
  static constexpr std::uint8_t depths[]{8, 16, 1, 2, 4, 3};
  Png header;
  put_big_endian(header, script.byte());
  put_big_endian(header, script.byte());
  header.push_back(depths[script.byte() % 6]);
  header.push_back(script.byte() % 8);
  header.insert(header.end(), {0, 0});
  header.push_back(script.byte() % 3);
  const auto lines = script.piece(std::size_t{1} << 20);
  Png packed(compressBound(lines.size()));
  uLongf length = packed.size();
  compress2(packed.data(), &length, lines.data(), lines.size(), Z_BEST_SPEED);
  packed.resize(length);
  Png png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  put_chunk(png, "IHDR", header);
  put_chunk(png, "IDAT", packed);
  put_chunk(png, "IEND", {});
  return png;
}

void put_checksums_right(Png& png) {
  for (std::size_t at = 8; at + 12 <= png.size();) {
    const std::size_t body =
        std::size_t{png[at]} << 24 | std::size_t{png[at + 1]} << 16 | std::size_t{png[at + 2]} << 8 | png[at + 3];
    if (body > png.size() - at - 12) return;
    Png crc;
    put_big_endian(crc, static_cast<std::uint32_t>(crc32(0, png.data() + at + 4, static_cast<uInt>(body + 4))));
    std::copy(crc.begin(), crc.end(), png.begin() + static_cast<std::ptrdiff_t>(at + 8 + body));
    at += 12 + body;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  if (size < 2) return 0;
  Png png(data + 1, data + size);
  if (data[0] == 'P') {
    put_checksums_right(png);
  } else if (data[0] != 'p') {
    png = built(Script(data, size));
  }
  static const fuzz::MemoryFile file;
  file.fill(png);
  const auto grid = read_png_heights(file.path(), 20, 10, -3, 2);
  if (grid) {
    fuzz::check(*grid);
    for (const float z : grid->z_m) fuzz::require(std::isnan(z) || (z >= -3 && z <= 2));  // a transparent pixel is a hole
  } else {
    fuzz::require(grid.error().text.starts_with(file.path().string() + ": "));
  }
  return 0;
}
