#include "daemon/commands/render/npy.hpp"

#include <bit>

namespace sonar::render {

static_assert(std::endian::native == std::endian::little, "arrays are written in the byte order of the memory");

std::string npy_header(std::string_view type, std::initializer_list<std::size_t> shape) {
  std::string sizes;
  for (const std::size_t n : shape) sizes += std::to_string(n) + (shape.size() == 1 ? "," : ", ");
  if (shape.size() > 1) sizes.resize(sizes.size() - 2);
  std::string dictionary = "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (" + sizes + "), }";
  constexpr std::size_t before = 10, multiple = 64;  // magic, version and length precede the dictionary
  const std::size_t whole = (before + dictionary.size() + 1 + multiple - 1) / multiple * multiple;
  dictionary.resize(whole - before - 1, ' ');
  dictionary += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(dictionary.size() & 0xff);
  header += static_cast<char>(dictionary.size() >> 8);
  return header + dictionary;
}

}  // namespace sonar::render
