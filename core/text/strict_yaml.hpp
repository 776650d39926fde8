// Strict YAML: cursors over a parsed file that have the position of every value and reject unknown keys. Configuration files
// and scenes are read with it. Only strict_yaml.cpp may include yaml-cpp.
//
//   auto document = text::parse_yaml_file(path, {.error_kind = ErrorKind::config});
//   if (!document) return tl::make_unexpected(document.error());
//   text::Map root = document->root();
//   config.scene = root.required("scene").text();
//   config.rate_hz = root.optional("rate_hz").number_or(10, text::Range::between(0.1, 40));
//   for (text::Node sonar : root.required("sonars").items(1, 16)) read_sonar(sonar.map());
//   if (auto error = document->finish()) return tl::make_unexpected(*error);
//
// Readers never stop at an error: a wrong value is read as zero, empty, the first choice or the fallback. finish() returns the
// first error. Accepted: one document without anchors, aliases, tags, merge keys; its keys are plain words.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.hpp"

namespace sonar::text {

struct YamlNode;
struct YamlTree;
class Map;

/// The accepted numbers. Infinity is accepted only if `infinity` is true; NaN is never accepted.
struct Range {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
  bool min_excluded = false;
  bool infinity = false;  // "inf", "-inf" and YAML's ".inf" are accepted when max (or min) is infinite or left open
  static constexpr Range at_least(double v) { return {.min = v}; }
  static constexpr Range above(double v) { return {.min = v, .min_excluded = true}; }
  static constexpr Range at_most(double v) { return {.max = v}; }
  static constexpr Range between(double lo, double hi) { return {.min = lo, .max = hi}; }
};

/// A cursor on a value, or on a missing value. It is cheap to copy, and valid while its Document lives.
class Node {
 public:
  bool present() const { return node_ != nullptr; }
  explicit operator bool() const { return present(); }
  bool is_null() const;
  bool is_scalar() const;
  bool is_sequence() const;
  bool is_map() const;

  /// Returns the text of a scalar. An empty text is an error unless it is allowed. `max_length` is in bytes.
  std::string text(std::size_t max_length = 4096, bool allow_empty = false) const;
  std::string text_or(std::string fallback, std::size_t max_length = 4096) const;
  /// Reads a decimal number: no hexadecimal, no leading zeros (012), no digits grouped with _, no quotes.
  double number(Range range = {}) const;
  double number_or(double fallback, Range range = {}) const;
  std::int64_t integer(std::int64_t min, std::int64_t max) const;
  std::int64_t integer_or(std::int64_t fallback, std::int64_t min, std::int64_t max) const;
  std::uint64_t unsigned_integer_or(std::uint64_t fallback, std::uint64_t max = std::numeric_limits<std::uint64_t>::max()) const;
  /// Accepts only the words true and false.
  bool boolean() const;
  bool boolean_or(bool fallback) const;

  /// Returns the index of one of the names. The error suggests the nearest name.
  std::size_t choice_index(std::vector<std::string_view> names) const;
  template <class T>
  T choice(std::initializer_list<std::pair<std::string_view, T>> choices) const {
    std::vector<std::string_view> names;
    for (const auto& c : choices) names.push_back(c.first);
    return (choices.begin() + choice_index(std::move(names)))->second;
  }
  template <class T>
  T choice_or(T fallback, std::initializer_list<std::pair<std::string_view, T>> choices) const {
    return present() ? choice<T>(choices) : fallback;
  }

  /// Reads a list of exactly N numbers.
  template <std::size_t N>
  std::array<double, N> numbers(Range range = {}) const {
    std::array<double, N> out{};
    fill_numbers(out.data(), N, range);
    return out;
  }
  template <std::size_t N>
  std::array<double, N> numbers_or(std::array<double, N> fallback, Range range = {}) const {
    return present() ? numbers<N>(range) : fallback;
  }
  std::vector<std::string> texts(std::size_t min_count = 0, std::size_t max_count = 256) const;

  /// Returns the elements of the list, or none if it is absent, too long or not a list.
  std::vector<Node> items(std::size_t min_count = 0, std::size_t max_count = 100000) const;
  /// Returns the value as a map; an empty map if it is absent or not a map.
  Map map() const;

  /// Records an error at this value, e.g. `node.fail("is not an address; write it as 127.0.0.2")`. Only the first error is kept.
  void fail(std::string_view what) const;
  std::string path() const;      // "sonars[0].mount.xyz_m"
  std::string location() const;  // "file:line:col"
  std::string key() const;       // last part of the path; empty for list elements

 private:
  friend class Map;
  friend class Document;
  Node(YamlTree* tree, YamlNode* node, YamlNode* parent, std::string key)
      : tree_(tree), node_(node), parent_(parent), key_(std::move(key)) {}
  bool expect_scalar(std::string_view wanted) const;
  void fill_numbers(double* out, std::size_t count, Range range) const;

  YamlTree* tree_ = nullptr;
  YamlNode* node_ = nullptr;    // null = absent
  YamlNode* parent_ = nullptr;  // parent of an absent node, with key_
  std::string key_;
};

/// A cursor on a map. Keys that a reader requests are valid; Document::finish() rejects all others.
class Map {
 public:
  bool has(std::string_view key) const;  // does not make the key valid
  Node required(std::string_view key);
  Node optional(std::string_view key);
  /// Returns all keys with their values, for maps whose keys are names chosen by the user.
  std::vector<std::pair<std::string, Node>> entries();
  void fail(std::string_view what) const;
  std::string path() const;

 private:
  friend class Node;
  friend class Document;
  Map(YamlTree* tree, YamlNode* node) : tree_(tree), node_(node) {}
  YamlTree* tree_ = nullptr;
  YamlNode* node_ = nullptr;  // null = the map is missing
};

/// A parsed file. It owns the values of its cursors, and can be moved.
class Document {
 public:
  explicit Document(std::unique_ptr<YamlTree> tree);
  Document(Document&&) noexcept;
  Document& operator=(Document&&) noexcept;
  ~Document();

  Map root() const;
  /// Returns a copy, not read yet, with each key and scalar changed by `change`, or the first error of `change`. The copy keeps
  /// the positions. Making it takes less time than parsing a changed text.
  Result<Document> changed(const std::function<Result<std::string>(const std::string& text, int line)>& change) const;
  /// Returns the first error. Wrong values come first, and missing keys before unknown keys that do not resemble them.
  std::optional<Error> finish() const;
  /// Returns the first wrong value so far. Unknown keys are not checked.
  std::optional<Error> error() const;

 private:
  std::unique_ptr<YamlTree> tree_;
};

struct YamlLimits {
  // Kind of every error in the document. For a file that cannot be opened, the kind is always missing_file.
  ErrorKind error_kind = ErrorKind::config;
  std::size_t max_bytes = std::size_t{4} << 20;
  std::size_t max_nodes = 400000;
  int max_depth = 24;
};

/// Parses a text. `name` is the file name with which errors start.
Result<Document> parse_yaml(std::string_view text, std::string name, const YamlLimits& limits = {});
/// Reads and parses a file. Errors print the path as given.
Result<Document> parse_yaml_file(const std::filesystem::path& file, const YamlLimits& limits = {});

}  // namespace sonar::text
