// Converts the control protocol's messages from and to JSON. Received text is parsed twice: first by our strict reader, which
// limits the depth and refuses invalid JSON and duplicate keys, then by the reader of protobuf, which checks the messages.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>

#include <nlohmann/json.hpp>
#include <set>

#include "protocol/control/control.hpp"
#include "protocol/control/json_checks.hpp"
#include "protocol/control/messages.hpp"
#include "protocol/control/refused.hpp"

namespace sonar::control {
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
