// A TIFF file for tests, written field by field.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace sonar::tests {

/// A TIFF of one strip, from the format's description: field by field.
struct TiffFile {
  struct Field {
    std::uint16_t tag, type;
    std::uint32_t count;
    std::string value;  // little-endian
  };
  template <class T>
  static std::string bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size()};
  }
  std::vector<Field> fields;
  std::string heights;

  TiffFile& shorts(std::uint16_t tag, const std::vector<std::uint16_t>& v) {
    fields.push_back({tag, 3, static_cast<std::uint32_t>(v.size()), bytes_of(v)});
    return *this;
  }
  void longs(std::uint16_t tag, const std::vector<std::uint32_t>& v) {
    fields.push_back({tag, 4, static_cast<std::uint32_t>(v.size()), bytes_of(v)});
  }
  void doubles(std::uint16_t tag, const std::vector<double>& v) {
    fields.push_back({tag, 12, static_cast<std::uint32_t>(v.size()), bytes_of(v)});
  }
  void text(std::uint16_t tag, const std::string& v) {
    fields.push_back({tag, 2, static_cast<std::uint32_t>(v.size() + 1), v + '\0'});
  }

  template <class T>
  static TiffFile of(std::uint16_t columns, std::uint16_t rows, const std::vector<T>& heights) {
    TiffFile f;
    f.heights = bytes_of(heights);
    f.shorts(256, {columns}), f.shorts(257, {rows}), f.shorts(258, {8 * sizeof(T)}), f.shorts(259, {1}), f.shorts(262, {1});
    f.longs(273, {8}), f.shorts(277, {1}), f.shorts(278, {rows}), f.longs(279, {static_cast<std::uint32_t>(f.heights.size())});
    f.shorts(339, {std::is_floating_point_v<T> ? std::uint16_t{3} : std::is_signed_v<T> ? std::uint16_t{2} : std::uint16_t{1}});
    return f;
  }
  TiffFile& at(double west, double north, double cell_x, double cell_y) {
    doubles(33550, {cell_x, cell_y, 0});
    doubles(33922, {0, 0, 0, west, north, 0});
    return *this;
  }
  TiffFile& keys(const std::vector<std::array<std::uint16_t, 2>>& keys) {
    std::vector<std::uint16_t> words{1, 1, 0, static_cast<std::uint16_t>(keys.size())};
    for (const auto& [key, value] : keys) words.insert(words.end(), {key, 0, 1, value});
    shorts(34735, words);
    return *this;
  }
  /// Keys of which some are texts or numbers of the tags 34737 and 34736.
  TiffFile& cited(const std::vector<std::array<std::uint16_t, 2>>& keys, std::uint16_t citation, const std::string& value) {
    std::vector<std::uint16_t> words{1, 1, 0, static_cast<std::uint16_t>(keys.size() + 1)};
    for (const auto& [key, number] : keys) words.insert(words.end(), {key, 0, 1, number});
    words.insert(words.end(), {citation, 34737, static_cast<std::uint16_t>(value.size() + 1), 0});
    shorts(34735, words), text(34737, value + "|");
    return *this;
  }
  /// Adds further bands with the same heights; `extra`: the kind of each, 2 for an alpha band.
  TiffFile& bands(const std::vector<std::uint16_t>& extra) {
    without(277).shorts(277, {static_cast<std::uint16_t>(extra.size() + 1)}).shorts(338, extra);
    return *this;
  }
  TiffFile& without(std::uint16_t tag) {
    std::erase_if(fields, [&](const Field& f) { return f.tag == tag; });
    return *this;
  }

  /// Returns the bytes of a file with another picture after this one.
  std::string bytes_before(const TiffFile& next) const {
    std::string out = bytes(), more = next.bytes();
    out.resize(out.size() + out.size() % 2);
    const auto start = static_cast<std::uint32_t>(out.size());
    const auto add = [&](std::string& in, std::size_t at) {
      std::uint32_t v = 0;
      std::memcpy(&v, in.data() + at, 4);
      v += start;
      std::memcpy(in.data() + at, &v, 4);
    };
    std::uint32_t directory = 0;
    std::memcpy(&directory, out.data() + 4, 4);
    std::uint32_t second = 0;
    std::memcpy(&second, more.data() + 4, 4);
    second += start;
    std::memcpy(out.data() + directory + 2 + 12 * fields.size(), &second, 4);
    for (std::size_t k = 0; k < next.fields.size(); ++k) {  // its strip lies farther back, too
      const std::size_t at = second - start + 2 + 12 * k;
      if (static_cast<unsigned char>(more[at]) == 273 % 256 && more[at + 1] == 1) add(more, at + 8);
    }
    return out + more;
  }
  /// `big`: the numbers of the directory are big-endian; `heights` stay as they are.
  std::string bytes(bool big = false) const {
    std::vector<Field> sorted = fields;
    std::sort(sorted.begin(), sorted.end(), [](const Field& a, const Field& b) { return a.tag < b.tag; });
    const auto ordered = [&](std::string numbers, std::size_t size) {
      for (std::size_t at = 0; big && at < numbers.size(); at += size)
        std::reverse(numbers.begin() + static_cast<std::ptrdiff_t>(at), numbers.begin() + static_cast<std::ptrdiff_t>(at + size));
      return numbers;
    };
    const auto word = [&](std::uint32_t v) { return ordered(bytes_of(std::vector<std::uint32_t>{v}), 4); };
    const auto half = [&](std::uint16_t v) { return ordered(bytes_of(std::vector<std::uint16_t>{v}), 2); };
    const std::size_t directory = 8 + heights.size() + heights.size() % 2;
    std::string out = (big ? "MM" : "II") + half(42) + word(static_cast<std::uint32_t>(directory)) + heights, more;
    out.resize(directory);
    out += half(static_cast<std::uint16_t>(sorted.size()));
    const std::size_t behind = directory + 2 + 12 * sorted.size() + 4;
    for (const Field& f : sorted) {
      out += half(f.tag) + half(f.type) + word(f.count);
      std::string value = ordered(f.value, f.value.size() / f.count);
      if (value.size() > 4) {
        out += word(static_cast<std::uint32_t>(behind + more.size()));
        more += value + std::string(value.size() % 2, '\0');
      } else {
        value.resize(4);
        out += value;
      }
    }
    return out + word(0) + more;
  }
};

}  // namespace sonar::tests
