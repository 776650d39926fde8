#include "protocol/control/messages.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "core/base/letters.hpp"

namespace sonar::control {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

/// Returns the path with the name of a field, without the `value` of wrappers such as DoubleValue, which users do not write.
std::string joined(const std::string& path, const FieldDescriptor& field) {
  if (field.containing_type()->full_name().starts_with("google.protobuf.")) return path;
  return path.empty() ? field.name() : path + "." + field.name();
}

using Predicate = std::function<bool(const Message&, const FieldDescriptor*)>;  // called with null for the message itself
/// Returns the path of the first field or message for which `bad` is true.
std::optional<std::string> find_first(const Message& message, const std::string& path, const Predicate& bad) {
  if (bad(message, nullptr)) return path;
  std::vector<const FieldDescriptor*> given;
  const Reflection& fields = *message.GetReflection();
  fields.ListFields(message, &given);
  for (const FieldDescriptor* field : given) {
    const std::string name = joined(path, *field);
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      if (bad(message, field)) return name;
      continue;
    }
    if (!field->is_repeated()) {
      if (auto found = find_first(fields.GetMessage(message, field), name, bad)) return found;
      continue;
    }
    for (int i = 0; i < fields.FieldSize(message, field); ++i)
      if (auto found = find_first(fields.GetRepeatedMessage(message, field, i), name + "[" + std::to_string(i) + "]", bad))
        return found;
  }
  return std::nullopt;
}

/// Returns the text with '?' for each byte that belongs to no UTF-8 character, because receivers refuse proto3 messages with
/// other texts.
std::string repaired(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t n = utf8_length(text);
    n == 0 ? out += '?' : out.append(text.substr(0, n));
    text.remove_prefix(std::max<std::size_t>(n, 1));
  }
  return out;
}

void repair_text(Message& message, const FieldDescriptor& field) {
  const Reflection& fields = *message.GetReflection();
  if (field.is_repeated())
    for (int i = 0; i < fields.FieldSize(message, &field); ++i)
      fields.SetRepeatedString(&message, &field, i, repaired(fields.GetRepeatedString(message, &field, i)));
  else
    fields.SetString(&message, &field, repaired(fields.GetString(message, &field)));
}

}  // namespace

void keep_protobuf_quiet() { [[maybe_unused]] static const auto previous = google::protobuf::SetLogHandler(nullptr); }

bool parse(Message& message, BytesView bytes) {
  keep_protobuf_quiet();
  return bytes.size() <= static_cast<std::size_t>(std::numeric_limits<int>::max()) &&
         message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

Bytes serialized(const Message& message) {
  Bytes out(message.ByteSizeLong());
  message.SerializeToArray(out.data(), static_cast<int>(out.size()));
  return out;
}

std::optional<std::string> first_unreal_number(const Message& message) {
  return find_first(message, "", [](const Message& m, const FieldDescriptor* field) {
    return field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE &&
           !std::isfinite(m.GetReflection()->GetDouble(m, field));  // no field of control.proto is a list of doubles
  });
}

// An absent orientation is not visited, because it counts as level.
std::optional<std::string> first_bad_orientation(const Message& message) {
  return find_first(message, "", [](const Message& m, const FieldDescriptor* field) {
    if (field != nullptr || m.GetDescriptor() != v1::Quat::descriptor()) return false;
    const auto& q = dynamic_cast<const v1::Quat&>(m);
    const double norm = std::hypot(std::hypot(q.w(), q.x()), std::hypot(q.y(), q.z()));
    return !(std::abs(norm - 1) <= largest_norm_error);
  });
}

void repair_texts(Message& message) {
  std::vector<const FieldDescriptor*> given;
  const Reflection& fields = *message.GetReflection();
  fields.ListFields(message, &given);
  for (const FieldDescriptor* field : given) {
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_STRING) repair_text(message, *field);
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      repair_texts(*fields.MutableMessage(&message, field));
      continue;
    }
    for (int i = 0; i < fields.FieldSize(message, field); ++i) repair_texts(*fields.MutableRepeatedMessage(&message, field, i));
  }
}

}  // namespace sonar::control
