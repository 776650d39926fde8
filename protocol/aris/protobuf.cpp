#include "protocol/aris/protobuf.hpp"

#include <algorithm>
#include <iterator>

namespace sonar::aris::protobuf {

// Source: the protobuf encoding guide. A field is a varint `number << 3 | wire type` and a value.
void append_varint(Bytes& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) out.push_back(static_cast<std::byte>((value & 0x7F) | 0x80));
  out.push_back(static_cast<std::byte>(value));
}

void Writer::operator()(unsigned number, float value) {
  key(number, WireType::fixed32);
  wire::Writer write(out_);
  write("float", value);
}

void Writer::operator()(unsigned number, const std::string& value) {
  key(number, WireType::length_delimited);
  append_varint(out_, value.size());
  std::transform(value.begin(), value.end(), std::back_inserter(out_), [](char c) { return static_cast<std::byte>(c); });
}

void Writer::operator()(unsigned number, BytesView value) {
  key(number, WireType::length_delimited);
  append_varint(out_, value.size());
  out_.insert(out_.end(), value.begin(), value.end());
}

// A varint has 7 bits per byte, the lowest first; the top bit means that another byte follows. More than 10 bytes are an error.
std::optional<std::uint64_t> RawReader::varint() {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
    const auto byte = std::to_integer<std::uint64_t>(rest_.front());
    rest_ = rest_.subspan(1);
    value |= (byte & 0x7F) << shift;
    if (byte < 0x80) return value;
  }
  ok_ = false;
  return std::nullopt;
}

std::optional<std::uint64_t> RawReader::fixed(std::size_t bytes) {
  if (rest_.size() < bytes) {
    ok_ = false;
    return std::nullopt;
  }
  std::uint64_t value = 0;
  for (std::size_t i = bytes; i > 0; --i) value = value << 8 | std::to_integer<std::uint64_t>(rest_[i - 1]);
  rest_ = rest_.subspan(bytes);
  return value;
}

// Groups (wire types 3 and 4) are errors: ARIS messages and proto3 have none.
std::optional<RawField> RawReader::next() {
  if (rest_.empty() || !ok_) return std::nullopt;
  const auto key = varint();
  if (!key) return std::nullopt;
  RawField field;
  field.number = static_cast<unsigned>(*key >> 3);
  field.type = static_cast<WireType>(*key & 7);
  std::optional<std::uint64_t> value;
  switch (field.type) {
    case WireType::varint:
    case WireType::length_delimited:
      value = varint();
      break;
    case WireType::fixed32:
      value = fixed(4);
      break;
    case WireType::fixed64:
      value = fixed(8);
      break;
  }
  ok_ = value && field.number != 0;
  if (!ok_) return std::nullopt;
  field.value = *value;
  if (field.type != WireType::length_delimited) return field;
  ok_ = *value <= rest_.size();
  if (!ok_) return std::nullopt;
  field.bytes = rest_.first(static_cast<std::size_t>(*value));
  rest_ = rest_.subspan(field.bytes.size());
  return field;
}

}  // namespace sonar::aris::protobuf
