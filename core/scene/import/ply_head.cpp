#include "core/scene/import/ply_head.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <sstream>

#include "core/base/letters.hpp"

namespace sonar {
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
  std::replace(text.begin(), text.end(), '\r', '\n');  // for the importer, too, either one ends a line
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word, second, third;
    words >> word >> second >> third;
    if (word == "format") head.is_text = second == "ascii";
    if (word == "element") head.elements.push_back({second.substr(0, 32), count_from(third), {}});
    if (word == "property" && !head.elements.empty()) {
      const bool is_list = second == "list";
      head.elements.back().properties.push_back({is_list, bytes_of(is_list ? third : second)});
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
