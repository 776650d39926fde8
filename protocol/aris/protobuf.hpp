// The part of the Protocol Buffers encoding that ARIS messages need. A message is described once, by fields(visit, message)
// with the numbers of its fields; the visitors here write and read it. protoc's classes are not used, because they omit fields
// that are zero, and older controllers ignore a sonar whose beacon lacks its model or state.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "protocol/wire/wire.hpp"

namespace sonar::aris::protobuf {

using wire::Bytes;
using wire::BytesView;

enum class WireType : std::uint8_t { varint = 0, fixed64 = 1, length_delimited = 2, fixed32 = 5 };

void append_varint(Bytes& out, std::uint64_t value);

/// Appends a message's fields, including zeros; an empty std::optional or vector is omitted.
class Writer {
 public:
  explicit Writer(Bytes& out) : out_(out) {}

  template <class T>
  void operator()(unsigned number, const std::optional<T>& value) {
    if (value) (*this)(number, *value);
  }
  template <class T>
  void operator()(unsigned number, const std::vector<T>& values) {
    for (const T& value : values) (*this)(number, value);
  }
  void operator()(unsigned number, float value);
  void operator()(unsigned number, const std::string& value);
  void operator()(unsigned number, BytesView value);
  template <class T>
  void operator()(unsigned number, const T& value) {
    if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
      key(number, WireType::varint);
      append_varint(out_, static_cast<std::uint64_t>(value));
    } else {
      Bytes inside;
      Writer writer(inside);
      fields(writer, value);
      (*this)(number, BytesView(inside));
    }
  }

 private:
  void key(unsigned number, WireType type) { append_varint(out_, std::uint64_t{number} << 3 | static_cast<unsigned>(type)); }
  Bytes& out_;
};

/// One undecoded field of a message.
struct RawField {
  unsigned number = 0;
  WireType type{};
  std::uint64_t value = 0;  // value of a varint or a fixed number
  BytesView bytes;          // content of a length-delimited field; points into the message
};

/// Reads the fields of a message one by one, without interpreting them.
class RawReader {
 public:
  explicit RawReader(BytesView message) : rest_(message) {}
  /// Returns the next field; nullopt at the end of the message or, with ok() false, if the bytes are not a field.
  std::optional<RawField> next();
  bool ok() const { return ok_; }

 private:
  std::optional<std::uint64_t> varint();
  std::optional<std::uint64_t> fixed(std::size_t bytes);
  BytesView rest_;
  bool ok_ = true;
};

template <class M>
bool read(BytesView bytes, M& message);

/// Stores one received field in the member that has the same number and type in the description of the message.
class Reader {
 public:
  explicit Reader(const RawField& field) : field_(field) {}
  bool ok() const { return ok_; }

  template <class T>
  void operator()(unsigned number, std::optional<T>& value) {
    if (number != field_.number) return;
    if (!value) value.emplace();
    (*this)(number, *value);
  }
  template <class T>
  void operator()(unsigned number, std::vector<T>& values) {
    if (number == field_.number && values.size() < most_repeated) (*this)(number, values.emplace_back());
  }
  void operator()(unsigned number, float& value) {
    if (has(number, WireType::fixed32)) value = std::bit_cast<float>(static_cast<std::uint32_t>(field_.value));
  }
  void operator()(unsigned number, std::string& value) {
    if (!has(number, WireType::length_delimited)) return;
    value.clear();
    for (const std::byte b : field_.bytes) value += static_cast<char>(b);
  }
  void operator()(unsigned number, BytesView& value) {
    if (has(number, WireType::length_delimited)) value = field_.bytes;
  }
  template <class T>
  void operator()(unsigned number, T& value) {
    if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
      if (!has(number, WireType::varint)) return;
      if constexpr (std::is_same_v<T, bool>)
        value = field_.value != 0;
      else
        value = static_cast<T>(static_cast<std::uint32_t>(field_.value));
    } else {
      if (has(number, WireType::length_delimited)) ok_ = read(field_.bytes, value) && ok_;
    }
  }

 private:
  static constexpr std::size_t most_repeated = 64;
  bool has(unsigned number, WireType type) {
    if (number != field_.number) return false;
    ok_ = ok_ && field_.type == type;
    return field_.type == type;
  }
  RawField field_;
  bool ok_ = true;
};

/// Reads a message; skips fields that the message does not describe. Returns false if the bytes are not a message of this kind.
template <class M>
bool read(BytesView bytes, M& message) {
  RawReader raw(bytes);
  bool fits = true;
  while (const auto field = raw.next()) {
    Reader reader(*field);
    fields(reader, message);
    fits = fits && reader.ok();
  }
  return raw.ok() && fits;
}

Bytes bytes_of(const auto& message) {
  Bytes out;
  Writer writer(out);
  fields(writer, message);
  return out;
}

}  // namespace sonar::aris::protobuf
