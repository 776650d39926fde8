#include "daemon/render/npy.hpp"

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

namespace sonar::render {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

std::string npy_header(std::string_view type, std::initializer_list<std::size_t> shape) {
  std::string sizes;
  for (const std::size_t n : shape) sizes += std::to_string(n) + (shape.size() == 1 ? "," : ", ");
  if (shape.size() > 1) sizes.resize(sizes.size() - 2);
  std::string dictionary = "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (" + sizes + "), }";
  constexpr std::size_t before = 10, multiple = 64;  // magic, version and length stand before the dictionary
  const std::size_t whole = (before + dictionary.size() + 1 + multiple - 1) / multiple * multiple;
  dictionary.resize(whole - before - 1, ' ');
  dictionary += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(dictionary.size() & 0xff);
  header += static_cast<char>(dictionary.size() >> 8);
  return header + dictionary;
}

Result<void> write_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts) {
  const std::filesystem::path unfinished = file.string() + ".tmp";
  const auto failed = [&](int error) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    return failure(ErrorKind::io, "cannot write " + file.string() + ": " + std::strerror(error) +
                                      "; make room or choose another --out; what is finished is kept");
  };
  std::FILE* out = std::fopen(unfinished.c_str(), "wb");
  if (out == nullptr) return failed(errno);
  for (const auto part : parts)
    if (std::fwrite(part.data(), 1, part.size(), out) != part.size()) {
      const int error = errno;
      std::fclose(out);
      return failed(error);
    }
  if (std::fclose(out) != 0) return failed(errno);
  std::error_code error;
  std::filesystem::rename(unfinished, file, error);
  if (error) return failed(error.value());
  return {};
}

}  // namespace sonar::render
