#include <algorithm>

#include "core/scene/import/check_mesh.hpp"

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

}  // namespace sonar
