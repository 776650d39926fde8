// XML files for the importers: elements with their positions in the file, and a list of errors and omissions. Only xml_file.cpp
// uses tinyxml2; it limits all sizes, so that any text is safe for the readers.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "core/base/result.hpp"

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace sonar::scene_tools {

struct XmlFile;

/// A line of a file, for errors (text()) and for the comments of a written scene (short_text()).
struct Place {
  const XmlFile* in = nullptr;
  int line = 0;
  std::string text() const;        // path/of/world.sdf:12
  std::string short_text() const;  // world.sdf:12, crate/model.sdf:12
};

/// An element, or an absent one, all of whose properties are empty.
class Element {
 public:
  Element() = default;
  Element(const XmlFile* file, const tinyxml2::XMLElement* xml) : file_(file), xml_(xml) {}
  explicit operator bool() const { return xml_ != nullptr; }
  std::string_view name() const;
  std::string_view text() const;                          // trimmed
  std::string_view attribute(const char* name) const;     // trimmed
  Element child(const char* name) const;                  // the first of that name
  std::vector<Element> children(const char* name) const;  // the children of that name
  std::vector<Element> children() const;                  // all
  Place place() const;
  const XmlFile* file() const { return file_; }

 private:
  const XmlFile* file_ = nullptr;
  const tinyxml2::XMLElement* xml_ = nullptr;
};

struct XmlFile {
  std::filesystem::path path;
  std::string short_name;
  std::shared_ptr<const tinyxml2::XMLDocument> document;
  std::size_t elements = 0;
  Element root() const;
};

inline constexpr std::size_t max_xml_bytes = std::size_t{16} << 20;

/// Errors begin with file:line. Files of more than max_xml_bytes, without a root element, or deeper than 100 elements are errors.
Result<std::shared_ptr<const XmlFile>> parse_xml(std::string_view text, const std::filesystem::path& path,
                                                 std::string short_name);

/// Collects errors and omissions of the readers. After an error they continue with zeros; only the first error is reported.
class Findings {
 public:
  void fail(const Place& at, const std::string& what);
  void leave_out(const Place& at, const std::string& what);  // lists each place and sentence once
  /// Counts an omitted element, such as a "light". The names of models, if any, are listed with the count.
  void leave_out_of_no_echo(const std::string& kind, std::string_view name = {});
  /// Lists a missing file once, with the number of references to it. `fetch`: the command that fetches it; may be
  /// empty. Files that the same command fetches are listed once.
  void leave_out_missing(const Place& at, const std::string& what, const std::string& fetch, std::size_t times = 1);
  bool failed() const { return error_.has_value(); }
  const std::optional<Error>& error() const { return error_; }
  /// Returns the list: what is missing, the counts of elements without an echo, the rest.
  std::vector<std::string> left_out() const;

 private:
  std::optional<Error> error_;
  std::vector<std::string> left_out_;
  struct Missing {
    std::string place, what, fetch;  // those of the first missing file
    std::size_t times = 0;
    std::set<std::string> names = {};
  };
  std::vector<Missing> missing_;
  struct Counted {
    std::size_t count = 0;
    std::set<std::string> names = {};  // the first few names
    bool more_names = false;
  };
  std::map<std::string, Counted> of_no_echo_;
  std::unordered_set<std::string> seen_;
};

/// Parses numbers separated by blanks. Fails unless there are exactly `count` numbers, all within -1e9 to 1e9.
std::vector<double> read_numbers(std::string_view text, std::size_t count, const Place& at, std::string_view what,
                                 Findings& findings);

/// Makes text from a file usable as a name or comment: one line, valid UTF-8, at most `most` bytes.
std::string plain(std::string_view text, std::size_t most = 64);

}  // namespace sonar::scene_tools
