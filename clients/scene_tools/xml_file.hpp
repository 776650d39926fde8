// An XML file as the importers see it: elements that know their position, and one list of complaints. Only this file uses
// tinyxml2; it bounds all sizes, so that the readers can accept any text.
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

/// A line of a file, for errors (`file`) and for the comments of a written scene (`short_name`).
struct Place {
  const XmlFile* in = nullptr;
  int line = 0;
  std::string text() const;        // path/of/world.sdf:12
  std::string short_text() const;  // world.sdf:12, crate/model.sdf:12
};

/// A cursor on one element, or on the absence of one: everything about an absent one is empty.
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

/// Errors: file:line: what. Refused: more than max_xml_bytes, no root element, elements more than 100 deep.
Result<std::shared_ptr<const XmlFile>> parse_xml(std::string_view text, const std::filesystem::path& path,
                                                 std::string short_name);

/// Errors and omissions of readers: they continue after an error with zeros, the first error counts; unread parts are listed.
class Findings {
 public:
  void fail(const Place& at, const std::string& what);
  void leave_out(const Place& at, const std::string& what);  // each place and sentence once
  /// "light": counted; the names of models, which may be empty, are listed with the count.
  void leave_out_of_no_echo(const std::string& kind, std::string_view name = {});
  bool failed() const { return error_.has_value(); }
  const std::optional<Error>& error() const { return error_; }
  /// First, in one line, how many of what has no echo.
  std::vector<std::string> left_out() const;

 private:
  std::optional<Error> error_;
  std::vector<std::string> left_out_;
  struct Counted {
    std::size_t count = 0;
    std::set<std::string> names = {};  // the first few
    bool more_names = false;
  };
  std::map<std::string, Counted> of_no_echo_;
  std::unordered_set<std::string> seen_;
};

/// Numbers between blanks. Fails unless there are exactly `count`, finite and within 1e9 either way.
std::vector<double> read_numbers(std::string_view text, std::size_t count, const Place& at, std::string_view what,
                                 Findings& findings);

/// Free text from a file, fit for a name or a comment: one line, valid UTF-8, at most `most` bytes.
std::string plain(std::string_view text, std::size_t most = 64);

}  // namespace sonar::scene_tools
