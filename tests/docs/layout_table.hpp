// A layout as a Markdown table: offset, type and name of each field from fields(), and its meaning in words.
#pragma once

#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "protocol/wire/wire.hpp"

namespace sonar::docs {

/// Lists offset, type and the vendor's name of every field.
class Namer : public wire::Visitor<Namer> {
 public:
  struct Row {
    std::size_t offset = 0, size = 0;
    std::string type, name;
  };
  std::vector<Row> rows;

 private:
  friend class wire::Visitor<Namer>;
  template <class T>
  static std::string type_name() {
    if constexpr (std::is_enum_v<T>) {
      return type_name<std::underlying_type_t<T>>();
    } else {
      return std::string(std::is_floating_point_v<T> ? "f" : (std::is_signed_v<T> ? "i" : "u"))
          .append(std::to_string(8 * sizeof(T)));
    }
  }
  void add(std::string type, std::string_view name, std::size_t size) {
    rows.push_back({offset_, size, std::move(type), prefix_ + std::string(name)});
    offset_ += size;
  }
  template <wire::Scalar T>
  void scalar(std::string_view name, const T&) {
    add(type_name<T>(), name, sizeof(T));
  }
  template <class A>
  void array(std::string_view name, A& values) {
    using Element = typename std::remove_const_t<A>::value_type;
    if constexpr (wire::Scalar<Element>) {
      add(type_name<Element>() + " x " + std::to_string(values.size()), name, values.size() * sizeof(Element));
    } else {
      wire::Visitor<Namer>::array(name, values);
    }
  }
  template <class M>
  void nested(std::string_view name, M& message) {
    const std::string outer = prefix_;
    prefix_ += std::string(name) + ".";
    fields(*this, message);
    prefix_ = outer;
  }
  std::size_t offset_ = 0;
  std::string prefix_;
};

/// Maps the name of a field to its meaning. A name without dots stands for the field at the end of every path.
using Meanings = std::map<std::string, std::string, std::less<>>;

/// Returns the rows of `M` whose names do not begin with a prefix of `left_out`. Throws if no field has the name of a meaning,
/// so that a renamed field does not lose its meaning.
template <class M>
std::string layout_table(const Meanings& meanings, std::initializer_list<std::string_view> left_out = {}) {
  Namer namer;
  const M message{};
  fields(namer, message);
  std::string text = "| offset | type | field | meaning |\n|---|---|---|---|\n";
  std::size_t used = 0;
  for (const Namer::Row& row : namer.rows) {
    bool wanted = true;
    for (const std::string_view prefix : left_out) wanted = wanted && !row.name.starts_with(prefix);
    if (!wanted) continue;
    auto meaning = meanings.find(row.name);
    if (meaning == meanings.end()) meaning = meanings.find(row.name.substr(row.name.rfind('.') + 1));
    if (meaning != meanings.end()) ++used;
    text += "| " + std::to_string(row.offset) + " | " + row.type + " | " + row.name + " | " +
            (meaning == meanings.end() ? "" : meaning->second) + " |\n";
  }
  if (used < meanings.size()) throw std::logic_error("no field has the name of one of the meanings\n" + text);
  return text + "\n";
}

}  // namespace sonar::docs
