#include "protocol/control/control_json.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>
#include <nlohmann/json.hpp>

#include "protocol/control/answers.hpp"
#include "protocol/control/control.hpp"
#include "protocol/control/messages.hpp"

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

// Converts the control protocol's messages from and to JSON. Received text is parsed twice: first by our strict reader, which
// limits the depth and refuses invalid JSON and duplicate keys, then by the reader of protobuf, which checks the messages.

namespace {

using google::protobuf::Message;
constexpr std::size_t deepest_request = 16, most_values = 4096;  // our choice: the longest request has some dozen values

/// Returns the name in the form in which protobuf compares names: "range_m" and "rangeM" are the same field.
std::string as_protobuf_reads(const std::string& name) {
  std::string read;
  bool after_underscore = false;
  for (const char c : name) {
    if (c != '_') read += after_underscore && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    after_underscore = c == '_';
  }
  return read;
}

/// Checks that a text is JSON (RFC 8259) without duplicate keys. protobuf's reader alone would also accept names without quotes,
/// 'text' and trailing commas, and use the last of two equal keys.
class StrictReader final : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::string why;  // the reason if the text is refused, else empty

  bool null() override { return count(); }
  bool boolean(bool) override { return count(); }
  bool number_integer(number_integer_t) override { return count(); }
  bool number_unsigned(number_unsigned_t) override { return count(); }
  bool number_float(number_float_t, const string_t&) override { return count(); }
  bool string(string_t&) override { return count(); }
  bool binary(binary_t&) override { return count(); }
  bool start_object(std::size_t) override { return enter(); }
  bool key(string_t& name) override {
    if (keys_.back().insert(as_protobuf_reads(name)).second) return true;
    why = in_quotes(name) + " is given twice";
    return false;
  }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception&) override {
    why = "not JSON: error at character " + std::to_string(position);
    return false;
  }

 private:
  bool count() {
    if (++values_ <= most_values) return true;
    why = "more than " + std::to_string(most_values) + " values";
    return false;
  }
  bool enter() {
    if (!count()) return false;
    keys_.emplace_back();
    if (keys_.size() <= deepest_request) return true;
    why = "nested deeper than " + std::to_string(deepest_request) + " levels";
    return false;
  }
  bool leave() {
    keys_.pop_back();
    return true;
  }
  std::vector<std::set<std::string>> keys_;  // keys so far of each unfinished object
  std::size_t values_ = 0;
};

/// Sets the name from the path of the request. Returns false if the message has another name, or has no field for a name.
bool set_name(Message& message, const std::string& name) {
  const auto& of = *message.GetDescriptor();
  const auto* field = of.FindFieldByName("sonar") != nullptr ? of.FindFieldByName("sonar") : of.FindFieldByName("object");
  if (field == nullptr) return false;
  const std::string given = message.GetReflection()->GetString(message, field);
  if (given.empty()) message.GetReflection()->SetString(&message, field, name);
  return given.empty() || given == name;
}

}  // namespace

Result<Request> request_from_json(std::string_view op, std::string_view json, std::string_view name) {
  keep_protobuf_quiet();
  v1::Request message;
  const auto* field = v1::Request::descriptor()->FindFieldByName(std::string(op));
  if (field == nullptr || field->containing_oneof() == nullptr) return refused("unknown request");
  if (json.size() > largest_json) return refused("longer than 1 MiB");
  // A zero byte ends the text for the strict reader but not for protobuf's reader, so the text after it would stay unchecked.
  if (const auto zero = json.find('\0'); zero != std::string_view::npos)
    return refused("not JSON: a zero byte at character " + std::to_string(zero + 1));
  StrictReader reader;
  if (!nlohmann::json::sax_parse(json, &reader)) return refused(reader.why);
  if (json.find_first_not_of(" \t\r\n") == std::string_view::npos || json[json.find_first_not_of(" \t\r\n")] != '{')
    return refused("not a JSON object: write {...}");
  const auto status = google::protobuf::util::JsonStringToMessage(google::protobuf::StringPiece(json.data(), json.size()),
                                                                  message.GetReflection()->MutableMessage(&message, field));
  if (!status.ok()) {
    const std::string mistake = mistake_in(json, *field->message_type()), words(status.message());
    return refused(!mistake.empty() ? mistake : "protobuf refuses it: " + words.substr(0, words.find('\n')));
  }
  if (!name.empty() && !set_name(*message.GetReflection()->MutableMessage(&message, field), std::string(name)))
    return refused("the path names " + in_quotes(std::string(name)) + ", but the message names another");
  auto request = from(message);
  if (!request) return refused(request.error().why);
  return *std::move(request);
}

std::string json_of(const Message& message) {
  const std::unique_ptr<Message> repaired(message.New());
  repaired->CopyFrom(message);
  repair_texts(*repaired);
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string out;
  if (!google::protobuf::util::MessageToJsonString(*repaired, &out, options).ok())
    return "{}";  // cannot happen, because the texts were repaired
  return out;
}
std::string json_of(StatusCode code, const std::string& text) { return json_of(status_of(code, text)); }

}  // namespace sonar::control
