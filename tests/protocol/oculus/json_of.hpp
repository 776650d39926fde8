// Converts any Oculus message to a JSON object with the vendor's names, by the description of its fields. The golden pairs use
// it, and so does dump_oculus, a program with which tests in other languages check our decoder.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>

#include "protocol/oculus/messages.hpp"

namespace sonar::oculus::tests {

class ToJson : public wire::Visitor<ToJson> {
 public:
  nlohmann::json object = nlohmann::json::object();

 private:
  friend class wire::Visitor<ToJson>;
  template <class T>
  static nlohmann::json plain(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      return static_cast<std::underlying_type_t<T>>(value);
    } else {
      return value;
    }
  }
  template <wire::Scalar T>
  void scalar(std::string_view name, const T& value) {
    object[std::string(name)] = plain(value);
  }
  template <class A>
  void array(std::string_view name, A& values) {
    for (const auto& value : values) object[std::string(name)].push_back(plain(value));
  }
  template <class M>
  void nested(std::string_view name, M& message) {
    ToJson inner;
    fields(inner, message);
    object[std::string(name)] = inner.object;
  }
};

template <class M>
nlohmann::json json_of(const M& message) {
  ToJson visit;
  fields(visit, message);
  return visit.object;
}

}  // namespace sonar::oculus::tests
