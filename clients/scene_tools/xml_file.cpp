#include "clients/scene_tools/xml_file.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/base/letters.hpp"
#include "core/text/format.hpp"

namespace sonar::scene_tools {
namespace {

constexpr std::size_t most_names = 8;
constexpr std::string_view blanks = " \t\r\n\f\v";

std::string_view trimmed_text(const char* text) { return text == nullptr ? std::string_view() : trimmed(text, blanks); }

constexpr int deepest = 100;  // the limit of tinyxml2 before version 10; later versions allow 500

/// Returns the first element below the depth `deepest`, or null. `count` receives the number of elements.
const tinyxml2::XMLElement* count_elements(const tinyxml2::XMLElement* first, int depth, std::size_t& count) {
  for (const tinyxml2::XMLElement* e = first; e != nullptr; e = e->NextSiblingElement()) {
    if (depth > deepest) return e;
    ++count;
    if (const auto* too_deep = count_elements(e->FirstChildElement(), depth + 1, count)) return too_deep;
  }
  return nullptr;
}

/// Returns the size of the UTF-8 character with which `text` begins; 0 if it is invalid.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xC2 && lead < 0xE0   ? 2
                             : lead >= 0xE0 && lead < 0xF0 ? 3
                             : lead >= 0xF0 && lead < 0xF5 ? 4
                                                           : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0u) != 0x80) return 0;
  const bool too_long = (lead == 0xE0 && byte(1) < 0xA0) || (lead == 0xF0 && byte(1) < 0x90);
  const bool no_character = (lead == 0xED && byte(1) >= 0xA0) || (lead == 0xF4 && byte(1) >= 0x90);
  const bool control = lead == 0xC2 && byte(1) < 0xA0;
  const bool line_end = lead == 0xE2 && byte(1) == 0x80 && (byte(2) == 0xA8 || byte(2) == 0xA9);
  const bool no_text = lead == 0xEF && (byte(1) == 0xBB || byte(1) == 0xBF) && byte(2) >= 0xBE;
  return too_long || no_character || control || line_end || no_text ? 0 : length;
}

}  // namespace

std::string Place::text() const {
  return in == nullptr ? std::string() : in->path.string() + ":" + std::to_string(std::max(line, 1));
}
std::string Place::short_text() const {
  return in == nullptr ? std::string() : in->short_name + ":" + std::to_string(std::max(line, 1));
}

std::string_view Element::name() const { return xml_ ? std::string_view(xml_->Name()) : std::string_view(); }
std::string_view Element::text() const { return xml_ ? trimmed_text(xml_->GetText()) : std::string_view(); }
std::string_view Element::attribute(const char* name) const {
  return xml_ ? trimmed_text(xml_->Attribute(name)) : std::string_view();
}
Element Element::child(const char* name) const { return {file_, xml_ ? xml_->FirstChildElement(name) : nullptr}; }
std::vector<Element> Element::children(const char* name) const {
  std::vector<Element> found;
  for (const auto* e = xml_ ? xml_->FirstChildElement(name) : nullptr; e != nullptr; e = e->NextSiblingElement(name))
    found.emplace_back(file_, e);
  return found;
}
std::vector<Element> Element::children() const { return children(nullptr); }
Place Element::place() const { return {file_, xml_ ? xml_->GetLineNum() : 0}; }

Element XmlFile::root() const { return {this, document->RootElement()}; }

Result<std::shared_ptr<const XmlFile>> parse_xml(std::string_view text, const std::filesystem::path& path,
                                                 std::string short_name) {
  const auto bad = [&](int line, const std::string& what) {
    return failure(ErrorKind::bad_data, path.string() + ":" + std::to_string(std::max(line, 1)) + ": " + what);
  };
  if (text.size() > max_xml_bytes) return bad(1, "is larger than 16 MiB; meshes belong in other files");
  if (text.find('\0') != std::string_view::npos) return bad(1, "is not a text file");
  auto document = std::make_shared<tinyxml2::XMLDocument>();
  const auto bad_nesting = [&](int line) { return bad(line, "elements nest more than " + std::to_string(deepest) + " deep"); };
  if (document->Parse(text.data(), text.size()) == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED)
    return bad_nesting(document->ErrorLineNum());
  if (document->ErrorID() == tinyxml2::XML_ERROR_EMPTY_DOCUMENT) return bad(1, "is empty");
  if (document->Error())
    return bad(document->ErrorLineNum(), std::string("not well-formed XML here (") + document->ErrorName() + ")");
  if (document->RootElement() == nullptr) return bad(1, "has no element; wanted <sdf> or <robot>");
  auto file = std::make_shared<XmlFile>();
  file->path = path;
  file->short_name = std::move(short_name);
  if (const auto* too_deep = count_elements(document->RootElement(), 1, file->elements))
    return bad_nesting(too_deep->GetLineNum());
  file->document = std::move(document);
  return file;
}

void Findings::fail(const Place& at, const std::string& what) {
  if (!error_) error_ = Error{ErrorKind::bad_data, at.text() + ": " + what};
}
std::vector<std::string> Findings::left_out() const {
  std::string counts;
  for (const auto& [kind, found] : of_no_echo_) {
    counts += (counts.empty() ? "" : ", ") + text::counted(found.count, kind);
    const std::string names = text::joined(found.names);
    if (!names.empty()) counts += " (" + names + (found.more_names ? ", .." : "") + ")";
  }
  std::vector<std::string> all;
  for (const Missing& m : missing_) {
    std::string times = m.times > 1 ? std::to_string(m.times) + " times" : "";
    if (m.names.size() > 1) times += ", " + std::to_string(m.names.size()) + " files";
    all.push_back(m.place + ": " + m.what + (times.empty() ? "" : " (" + times + ")") + ": not found" +
                  (m.fetch.empty() ? "" : "; fetch it: " + m.fetch));
  }
  if (!counts.empty()) all.push_back(counts + ": without an echo");
  all.insert(all.end(), left_out_.begin(), left_out_.end());
  return all;
}

void Findings::leave_out_of_no_echo(const std::string& kind, std::string_view name) {
  Counted& found = of_no_echo_[kind];
  ++found.count;
  const std::string shown = plain(name, 60);
  if (shown.empty() || found.names.contains(shown)) return;
  if (found.names.size() < most_names)
    found.names.insert(shown);
  else
    found.more_names = true;
}

void Findings::leave_out_missing(const Place& at, const std::string& what, const std::string& fetch, std::size_t times) {
  constexpr std::size_t most = 1000;
  auto known = std::find_if(missing_.begin(), missing_.end(),
                            [&](const Missing& m) { return fetch.empty() ? m.what == what : same_letters(m.fetch, fetch); });
  if (known == missing_.end()) {
    if (missing_.size() >= most) return;
    known = missing_.insert(known, {at.short_text(), what, fetch});
  }
  known->times += times;
  known->names.insert(small_letters(what));
}

void Findings::leave_out(const Place& at, const std::string& what) {
  std::string line = at.short_text() + ": " + what;
  constexpr std::size_t most = 1000;
  if (left_out_.size() < most && seen_.insert(line).second) left_out_.push_back(std::move(line));
}

std::vector<double> read_numbers(std::string_view text, std::size_t count, const Place& at, std::string_view what,
                                 Findings& findings) {
  std::vector<double> numbers;
  const std::string wanted = std::string(what) + ": ";
  while (!text.empty() && numbers.size() <= count) {
    const std::size_t begin = text.find_first_not_of(blanks);
    if (begin == std::string_view::npos) break;
    text.remove_prefix(begin);
    const std::string_view word = text.substr(0, text.find_first_of(blanks));
    text.remove_prefix(word.size());
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    double value = 0;
    const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (code != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value) || std::abs(value) > 1e9) {
      findings.fail(at, wanted + "\"" + plain(word) + "\" is not a number that a scene can hold" +
                            (word.find('$') == word.npos ? "" : "; is it xacro? Expand it first: xacro FILE.xacro > FILE.urdf"));
      return std::vector<double>(count, 0.0);
    }
    numbers.push_back(value);
  }
  if (numbers.size() == count) return numbers;
  findings.fail(at, wanted + std::to_string(count) + (count == 1 ? " number is" : " numbers are") + " needed here, not " +
                        (numbers.size() > count ? "more" : std::to_string(numbers.size())));
  return std::vector<double>(count, 0.0);
}

std::string plain(std::string_view text, std::size_t most) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const bool kept = length > 1 || (length == 1 && text[0] >= ' ' && text[0] < 0x7F);
    const std::size_t taken = std::max<std::size_t>(length, 1);
    if (out.size() + taken > most) break;
    out += kept ? std::string(text.substr(0, taken)) : "_";
    text.remove_prefix(taken);
  }
  return out;
}

}  // namespace sonar::scene_tools
