#include "protocol/control/json_checks.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <nlohmann/json.hpp>

namespace sonar::control {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using nlohmann::json;
constexpr std::size_t longest_shown = 64;

std::string shown(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

const FieldDescriptor* field_of(const Descriptor& type, const std::string& name) {
  for (int i = 0; i < type.field_count(); ++i)
    if (type.field(i)->name() == name || type.field(i)->json_name() == name) return type.field(i);
  return nullptr;
}

/// Converts a text with a number to the number, because protobuf accepts both. Returns other values unchanged.
json number_of(const json& value) {
  return value.is_string() ? json::parse(value.get_ref<const std::string&>(), nullptr, false) : value;
}

/// Returns the kind of value that protobuf expects here; empty if the value has that kind.
template <class T>
std::string expected_whole_number(const json& value) {
  using Limits = std::numeric_limits<T>;
  const json number = number_of(value);
  bool fits = false;
  if (number.is_number_unsigned()) {
    fits = std::in_range<T>(number.get<std::uint64_t>());
  } else if (number.is_number_integer()) {
    fits = std::in_range<T>(number.get<std::int64_t>());
  } else if (number.is_number_float()) {
    const auto real = number.get<double>();
    fits = std::trunc(real) == real && real >= static_cast<double>(Limits::min()) && real <= static_cast<double>(Limits::max());
  }
  return fits ? "" : "a whole number from " + std::to_string(Limits::min()) + " to " + std::to_string(Limits::max());
}

std::string expected_name(const json& value, const google::protobuf::EnumDescriptor& type) {
  if (value.is_number_integer()) return {};
  std::string names;
  for (int i = 0; i < type.value_count(); ++i) {
    if (value == type.value(i)->name()) return {};
    names += (i == 0 ? "" : i + 1 < type.value_count() ? ", " : " or ") + type.value(i)->name();
  }
  return names;
}

std::string expected_in(const json& value, const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return number_of(value).is_number() || value == "NaN" || value == "Infinity" || value == "-Infinity" ? "" : "a number";
    case FieldDescriptor::CPPTYPE_BOOL:
      return value.is_boolean() || value == "true" || value == "false" ? "" : "true or false";
    case FieldDescriptor::CPPTYPE_INT32:
      return expected_whole_number<std::int32_t>(value);
    case FieldDescriptor::CPPTYPE_UINT32:
      return expected_whole_number<std::uint32_t>(value);
    case FieldDescriptor::CPPTYPE_INT64:
      return expected_whole_number<std::int64_t>(value);
    case FieldDescriptor::CPPTYPE_UINT64:
      return expected_whole_number<std::uint64_t>(value);
    case FieldDescriptor::CPPTYPE_ENUM:
      return expected_name(value, *field.enum_type());
    case FieldDescriptor::CPPTYPE_STRING:
      return value.is_string() ? "" : "a text in quotes";
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return value.is_object() ? "" : "an object {...}";
  }
  return {};
}

std::string wrong(const std::string& place, const json& value, const std::string& expected) {
  return in_quotes(place) + ": invalid value " + shown(value).substr(0, longest_shown) + ", expected " + expected;
}

std::string in_message(const json& value, const Descriptor& type, const std::string& place);

std::string in_value(const json& value, const FieldDescriptor& field, const std::string& place) {
  if (const Descriptor* const type = field.message_type(); type != nullptr) {
    const bool is_wrapper = type->field_count() == 1 && type->field(0)->name() == "value";  // DoubleValue and others
    if (type->file()->package() == "google.protobuf") return is_wrapper ? in_value(value, *type->field(0), place) : "";
    if (value.is_object()) return in_message(value, *type, place);
  }
  const std::string expected = expected_in(value, field);
  return expected.empty() ? "" : wrong(place, value, expected);
}

std::string in_field(const json& value, const FieldDescriptor& field, const std::string& place) {
  if (!field.is_repeated()) return in_value(value, field, place);
  if (field.is_map() ? !value.is_object() : !value.is_array())
    return wrong(place, value, field.is_map() ? "an object {...}" : "a list [...]");
  const FieldDescriptor& one = field.is_map() ? *field.message_type()->map_value() : field;
  for (const auto& [key, member] : value.items())
    if (std::string why = in_value(member, one, place + '.' + key); !why.empty()) return why;
  return {};
}

std::string in_message(const json& value, const Descriptor& type, const std::string& place) {
  for (const auto& [key, member] : value.items()) {
    const std::string inner = place.empty() ? key : place + '.' + key;
    const FieldDescriptor* const field = field_of(type, key);
    if (field == nullptr) return in_quotes(inner) + ": unknown key";
    if (member.is_null()) continue;  // null counts as a missing member
    if (std::string why = in_field(member, *field, inner); !why.empty()) return why;
  }
  return {};
}

}  // namespace

std::string in_quotes(const std::string& name) { return shown(name.substr(0, longest_shown)); }

std::string mistake_in(std::string_view text, const Descriptor& type) {
  const json value = json::parse(text, nullptr, false);
  return value.is_object() ? in_message(value, type, "") : "";
}

}  // namespace sonar::control
