#include "core/scene/import/check_mesh.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <sstream>

#include "core/base/letters.hpp"

namespace sonar {

MeshFault check_ply(const PlyHead& head, std::uint64_t file_bytes) {
  // Assimp 5.2 never returns from reading a header that does not end.
  if (head.bytes == 0)
    return "cannot be read: not a PLY file with a whole header, of lines that end with a line feed; export it again";
  std::uint64_t all = 0;  // bytes that the elements need at least
  for (const PlyElement& element : head.elements) {
    if (element.name == "tristrips")
      return "stores its faces as strips of triangles (tristrips), which are not read; export it with faces";
    std::uint64_t least = 0;  // bytes of one such element
    for (const PlyProperty& property : element.properties) least += head.is_text ? 2 : property.bytes;
    const std::uint64_t count = std::min(element.count, file_bytes + 1);
    all = std::min<std::uint64_t>(all + count * std::max<std::uint64_t>(least, 1), std::uint64_t{1} << 62);
    if (element.count > file_bytes || all > file_bytes + 1)  // the last line end may be missing
      return "says that it has " + std::to_string(element.count) + " of \"" + element.name + "\", which its " +
             std::to_string(file_bytes) + " bytes cannot hold; it is cut short or damaged, export it again";
  }
  return std::nullopt;
}

std::uint64_t facets_of_stl(std::string_view file) {
  std::uint64_t facets = 0;
  for (std::size_t at = 0; at < file.size();) {
    const std::size_t end = std::min(file.find('\n', at), file.size());
    const std::size_t word = std::min(file.find_first_not_of(" \t", at), end);
    facets += file.substr(word, 6) == "facet " || file.substr(word, 6) == "FACET ";
    at = end + 1;
  }
  return facets;
}

namespace {

/// Size in a binary file; 1 for an unknown type.
std::uint64_t bytes_of(std::string_view type) {
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "float" || type == "int32" || type == "uint32" || type == "float32") return 4;
  if (type == "double" || type == "float64") return 8;
  return 1;
}

std::uint64_t count_from(const std::string& word) {
  std::uint64_t count = 0;
  const auto error = std::from_chars(word.data(), word.data() + word.size(), count).ec;
  return error == std::errc::result_out_of_range ? std::numeric_limits<std::uint64_t>::max() : count;
}

}  // namespace

PlyHead ply_head_of(std::string_view file) {
  PlyHead head;
  const std::string small = small_letters(file.substr(0, ply_head_bytes));
  const std::size_t end = small.find("end_header"), last = end == small.npos ? end : small.find('\n', end);
  if (!small.starts_with("ply") || last == small.npos) return head;
  head.bytes = last + 1;
  std::string text = small.substr(0, head.bytes);
  std::replace(text.begin(), text.end(), '\r', '\n');  // the importer, too, accepts both as line ends
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word, second, third, fourth;
    words >> word >> second >> third >> fourth;
    if (word == "format") head.is_text = second == "ascii", head.is_big_endian = second == "binary_big_endian";
    if (word == "element") head.elements.push_back({second.substr(0, 32), count_from(third), {}});
    if (word == "property" && !head.elements.empty()) {
      const bool is_list = second == "list";
      head.elements.back().properties.push_back({is_list, bytes_of(is_list ? third : second), is_list ? bytes_of(fourth) : 0});
    }
  }
  return head;
}

std::uint64_t PlyHead::faces() const {
  for (const PlyElement& element : elements)
    if (element.name == "face") return element.count;
  return 0;
}

}  // namespace sonar
