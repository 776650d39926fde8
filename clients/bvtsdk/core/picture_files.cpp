// Colour map files and pictures: the file side of colour_maps.hpp.
#include <cstring>

#include "clients/bvtsdk/core/bytes.hpp"
#include "clients/bvtsdk/core/colour_maps.hpp"

namespace sonar::bvt {
namespace {

constexpr std::size_t map_bytes = 3 * static_cast<std::size_t>(colour_map_entries);

Code save(const std::string& path, const std::string& header, const Bytes& body) {
  File file(std::fopen(path.c_str(), "wb"));
  if (!file) return file_create;
  const bool written = std::fwrite(header.data(), 1, header.size(), file.get()) == header.size() &&
                       std::fwrite(body.data(), 1, body.size(), file.get()) == body.size();
  const bool closed = std::fclose(file.release()) == 0;
  return written && closed ? success : file_write;
}

std::string header_of(const char* kind, const ImageGeometry& image, int full_scale) {
  return std::string(kind) + "\n" + std::to_string(image.width) + " " + std::to_string(image.height) + "\n" +
         std::to_string(full_scale) + "\n";
}

}  // namespace

Code load_colour_map(const std::string& path, ColourMap& map) {
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) return file_open;
  Bytes bytes(map_bytes + 1);
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file.get()));
  if (bytes.size() != map_bytes) return load_color_map;
  ColourMap loaded;
  for (std::size_t i = 0; i < map_bytes; i += 3) loaded.push_back({bytes[i], bytes[i + 1], bytes[i + 2]});
  map = std::move(loaded);
  return success;
}

Code save_colour_map(const std::string& path, const ColourMap& map) {
  Bytes bytes;
  for (const Colour& c : map) bytes.insert(bytes.end(), {c.blue, c.green, c.red});
  return save(path, {}, bytes);
}

Code save_pgm(const std::string& path, const MagImage& image) {
  Bytes body;
  body.reserve(2 * image.pixels.size());
  for (const std::uint16_t v : image.pixels) {
    body.push_back(static_cast<std::uint8_t>(v >> 8));
    body.push_back(static_cast<std::uint8_t>(v));
  }
  return save(path, header_of("P5", image, 65535), body);
}

Code save_ppm(const std::string& path, const ColourImage& image) {
  Bytes body;
  body.reserve(3 * image.pixels.size());
  for (const std::uint32_t pixel : image.pixels) {
    std::uint8_t b[4];
    std::memcpy(b, &pixel, sizeof b);
    if (image.order == PixelOrder::bgra)
      body.insert(body.end(), {b[2], b[1], b[0]});
    else
      body.insert(body.end(), {b[0], b[1], b[2]});
  }
  return save(path, header_of("P6", image, 255), body);
}

}  // namespace sonar::bvt
