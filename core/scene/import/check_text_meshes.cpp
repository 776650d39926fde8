#include <algorithm>
#include <charconv>

#include "core/base/letters.hpp"
#include "core/scene/import/check_mesh.hpp"

namespace sonar {
namespace {

constexpr std::string_view between_words = " \t\v\f", cut_short = "; it is cut short or damaged, export it again";

/// Lines of a text that end with a line feed, a carriage return or both.
class Lines {
 public:
  explicit Lines(std::string_view text, std::uint64_t lines_before = 0) : left_(text), number_(lines_before) {}
  bool next() {
    if (left_.empty()) return false;
    const std::size_t end = std::min(left_.find_first_of("\r\n"), left_.size());
    line_ = left_.substr(0, end);
    left_.remove_prefix(end);
    ends_ = !left_.empty();
    returns_ = left_.starts_with("\r\n");
    left_.remove_prefix(returns_ ? 2 : ends_ ? 1 : 0);
    ++number_;
    return true;
  }
  std::string_view line() const { return line_; }
  /// False only for a last line without a line end.
  bool has_end() const { return ends_; }
  bool ends_with_return() const { return returns_; }
  std::uint64_t number() const { return number_; }

 private:
  std::string_view left_, line_;
  bool ends_ = true, returns_ = false;
  std::uint64_t number_;
};

/// Removes the next word of `line` and returns it; empty at the end of the line.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(between_words), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(between_words));
  line.remove_prefix(word.size());
  return word;
}

bool is_like_number(std::string_view word) {
  const std::size_t sign = word.starts_with('-') || word.starts_with('+') ? 1 : 0;
  const std::string begin = small_letters(word.substr(sign, 3));
  return word.find_first_of("0123456789") != word.npos || begin == "nan" || begin == "inf";
}

std::string at_line(const Lines& lines) { return " (line " + std::to_string(lines.number()) + ")"; }

/// Describes the fault of one record, a line with the values of all properties; empty if there is none.
std::string fault_of_record(std::string_view line, const PlyElement& element) {
  std::uint64_t values = 0, needed = element.properties.size();
  std::uint64_t in_list = 0;  // values of a list that are left
  for (std::size_t property = 0; property < element.properties.size() || in_list > 0; ++values) {
    const std::string_view word = take_word(line);
    if (word.empty()) return " has " + std::to_string(values) + " of " + std::to_string(needed) + " values";
    if (!is_like_number(word)) return " has \"" + std::string(word.substr(0, 32)) + "\", which is not a number";
    if (in_list > 0) {
      --in_list;
    } else if (element.properties[property++].is_list) {
      std::from_chars(word.data(), word.data() + word.size(), in_list);
      needed += std::min<std::uint64_t>(in_list, std::uint64_t{1} << 62);
    }
  }
  return {};
}

/// True if `word` is "endsolid", or "end" before the word "solid", which then is removed from the line.
bool is_end_of_solid(std::string_view word, std::string_view& line) {
  if (same_letters(word, "endsolid")) return true;
  std::string_view rest = line;
  if (!same_letters(word, "end") || !same_letters(take_word(rest), "solid")) return false;
  line = rest;
  return true;
}

std::string place_in(const PlyElement& element, std::uint64_t k) {
  return element.name + " " + std::to_string(k + 1) + " of " + std::to_string(element.count);
}

/// Finds the first record that ends beyond the end of the file.
MeshFault check_binary_ply(std::string_view file, const PlyHead& head) {
  std::string_view rest = file.substr(head.bytes);
  const auto skip = [&](std::uint64_t count, std::uint64_t bytes) {
    if (bytes > 0 && count > rest.size() / bytes) return false;
    rest.remove_prefix(count * bytes);
    return true;
  };
  const auto skip_property = [&](const PlyProperty& p) {
    std::uint64_t items = 0;
    for (std::uint64_t b = 0; p.is_list && b < std::min<std::uint64_t>(p.bytes, rest.size()); ++b)
      items |= std::uint64_t{static_cast<unsigned char>(rest[b])} << 8 * (head.is_big_endian ? p.bytes - 1 - b : b);
    return skip(1, p.bytes) && skip(items, p.item_bytes);
  };
  for (const PlyElement& element : head.elements) {
    const auto& all = element.properties;
    for (std::uint64_t k = 0; k < element.count && !all.empty(); ++k)
      if (!std::all_of(all.begin(), all.end(), skip_property))
        return "ends within " + place_in(element, k) + ", which its header counts" + std::string(cut_short);
  }
  return std::nullopt;
}

}  // namespace

MeshFault check_ply_records(std::string_view file) {
  const PlyHead head = ply_head_of(file);
  if (!head.is_text) return check_binary_ply(file, head);
  const std::string_view lines_before = file.substr(0, head.bytes);
  Lines lines(file.substr(head.bytes), static_cast<std::uint64_t>(std::count(lines_before.begin(), lines_before.end(), '\n')));
  for (const PlyElement& element : head.elements)
    for (std::uint64_t k = 0; k < element.count && !element.properties.empty(); ++k) {
      const std::string which = place_in(element, k);
      bool there = lines.next();
      // The importer skips one blank line, and reads further ones as records.
      if (there && lines.line().empty() && !lines.ends_with_return()) there = lines.next();
      if (!there) return "ends before " + which + ", which its header counts" + std::string(cut_short);
      if (const std::string fault = fault_of_record(lines.line(), element); !fault.empty())
        return which + at_line(lines) + fault + std::string(cut_short);
    }
  return std::nullopt;
}

MeshFault check_stl_text(std::string_view file) {
  if (file.substr(0, 512).find('\0') != file.npos) return std::nullopt;  // binary
  std::uint64_t facets = 0, corners = 0, numbers_left = 0;
  bool in_facet = false, ended = false;
  Lines lines(file);
  const auto which = [&] { return "facet " + std::to_string(facets) + at_line(lines); };
  const auto wrong_corners = [&] {
    return which() + " has " + std::to_string(corners) + " corners, not 3" + std::string(cut_short);
  };
  while (lines.next()) {
    std::string_view line = lines.line();
    for (std::string_view word; !(word = take_word(line)).empty();) {
      if (numbers_left > 0) {
        if (!is_like_number(word)) return which() + " has a corner with fewer than 3 numbers" + std::string(cut_short);
        --numbers_left;
      } else if (const bool ends = is_end_of_solid(word, line); ends || same_letters(word, "solid")) {
        ended = ended || ends;
        if (ends && in_facet && corners != 3) return wrong_corners();
        in_facet = in_facet && !ends;
        // The name of the solid follows, up to the end of the line unless the file has only one line.
        constexpr std::string_view begin = "facet normal";
        const auto* const next_facet = std::search(line.begin(), line.end(), begin.begin(), begin.end(),
                                                   [](char a, char b) { return small_letter(a) == b; });
        line.remove_prefix(static_cast<std::size_t>(next_facet - line.begin()));
      } else if (same_letters(word, "facet")) {
        if (in_facet && corners != 3) return wrong_corners();
        in_facet = true, ended = false, corners = 0, ++facets;
      } else if (same_letters(word, "vertex")) {
        ++corners, numbers_left = 3;
      } else if (same_letters(word, "endfacet")) {
        if (corners != 3) return wrong_corners();
        in_facet = false;
      }
    }
  }
  if (numbers_left > 0 || in_facet) return "ends within " + which() + std::string(cut_short);
  if (!ended)
    return (facets == 0 ? "ends without a facet" : "ends after " + which() + " without endsolid") + std::string(cut_short);
  return std::nullopt;
}

MeshFault check_obj(std::string_view file) {
  Lines lines(file);
  std::uint64_t vertices = 0;
  while (lines.next()) {
    std::string_view line = lines.line();
    if (lines.number() == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
    const std::string_view statement = take_word(line);
    const bool is_vertex = statement == "v", is_face = statement == "f";
    if (!is_vertex && !is_face) continue;
    vertices += is_vertex;
    const Lines first = lines;
    std::uint64_t words = 0, numbers = 0;
    for (std::string_view word = take_word(line); !word.starts_with('#'); word = take_word(line)) {
      if (word == "\\" || (word.empty() && lines.line().ends_with('\\'))) {
        if (!lines.next()) break;  // continues in the next line
        line = lines.line();
        continue;
      }
      if (word.empty()) break;
      numbers += numbers == words && is_like_number(word);  // words after the numbers are a remark
      ++words;
    }
    if (is_vertex && numbers != 3 && numbers != 4 && numbers != 6)
      return "vertex " + std::to_string(vertices) + at_line(first) + " has " + std::to_string(numbers) +
             " numbers, not 3, 4 or 6" + (numbers > 4 ? "; export it without further ones" : std::string(cut_short));
    if (is_face && words < 3 && !lines.has_end())
      return "ends within a face" + at_line(first) + " of " + std::to_string(words) + " corners" + std::string(cut_short);
  }
  return std::nullopt;
}

}  // namespace sonar
