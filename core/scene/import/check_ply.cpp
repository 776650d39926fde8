#include <algorithm>
#include <charconv>
#include <sstream>

#include "core/base/letters.hpp"
#include "core/scene/import/check_mesh.hpp"

namespace sonar {
namespace {

/// Size in a binary file; 1 for an unknown type.
std::uint64_t bytes_of(std::string_view type) {
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "float" || type == "int32" || type == "uint32" || type == "float32") return 4;
  if (type == "double" || type == "float64") return 8;
  return 1;
}

}  // namespace

std::uint64_t bytes_of_ply_head(std::string_view head) {
  const std::size_t end = small_letters(head).find("end_header");
  return same_letters(head.substr(0, 3), "ply") && end != std::string::npos && head.find('\n', end) != std::string::npos
             ? head.find('\n', end) + 1
             : 0;
}

MeshFault check_ply(std::string_view file_head, std::uint64_t file_bytes) {
  // Assimp 5.2 never returns from reading a header that does not end.
  const std::size_t end = bytes_of_ply_head(file_head);
  if (end == 0) return "cannot be read: not a PLY file with a whole header, of lines that end with a line feed; export it again";
  const std::string head = small_letters(file_head.substr(0, end));
  std::istringstream lines(head);
  bool ascii = false;
  std::string element;
  std::uint64_t count = 0, least = 0,
                all = 0;  // bytes; `least`: minimum of one such element; `all`: sum of the elements before it
  const auto holds = [&] {
    all = std::min<std::uint64_t>(all + count * std::max<std::uint64_t>(least, 1), std::uint64_t{1} << 62);
    return all <= file_bytes + 1;  // the last line end may be missing
  };
  const auto too_many = [&] {
    return "says that it has " + std::to_string(count) + " of \"" + element.substr(0, 32) + "\", which its " +
           std::to_string(file_bytes) + " bytes cannot hold; it is cut short or damaged, export it again";
  };
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word, type, number;
    words >> word >> type;
    if (word == "format") ascii = type == "ascii";
    if (word == "property") least += ascii ? 2 : type == "list" ? (words >> type, bytes_of(type)) : bytes_of(type);
    if (word != "element") continue;
    if (!holds()) return too_many();
    if (type == "tristrips")
      return "stores its faces as strips of triangles (tristrips), which are not read; export it with faces";
    element = type, least = 0, count = 0;
    words >> number;
    if (std::from_chars(number.data(), number.data() + number.size(), count).ec == std::errc::result_out_of_range ||
        count > file_bytes) {
      count = std::max(count, file_bytes + 1);
      return too_many();
    }
  }
  if (!holds()) return too_many();
  return std::nullopt;
}

std::uint64_t faces_of_ply(std::string_view head) {
  std::istringstream lines(small_letters(head.substr(0, bytes_of_ply_head(head))));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word, type;
    std::uint64_t count = 0;
    if (words >> word >> type >> count && word == "element" && type == "face") return count;
  }
  return 0;
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

}  // namespace sonar
