#include "protocol/blueview/frames.hpp"

#include <zlib.h>
#include <algorithm>
#include <cstring>

namespace sonar::blueview {

void put_text(wire::Bytes& out, std::string_view text) {
  const auto length = static_cast<std::uint16_t>(std::min<std::size_t>(text.size(), 65535));
  const Put write(out);
  write("length", length);
  for (const char c : text.substr(0, length)) out.push_back(static_cast<std::byte>(c));
}

std::string read_text(wire::Reader& reader, std::string_view name) {
  std::uint16_t length = 0;
  reader(name, length);
  std::string text;
  for (const std::byte b : reader.block(name, reader.ok() ? length : 0)) text.push_back(static_cast<char>(b));
  return text;
}

// The kind precedes the value, so that a host can read the value of an unknown key. Exception: Key::range has two floats after
// the kind `number`.
void put_value(wire::Bytes& out, const Value& value) {
  const Put write(out);
  const auto kind = [&](Kind k) { write("kind", k); };
  if (const auto* i = std::get_if<std::int32_t>(&value)) {
    kind(Kind::integer);
    write("value", *i);
  } else if (const auto* f = std::get_if<float>(&value)) {
    kind(Kind::number);
    write("value", *f);
  } else if (const auto* pair = std::get_if<FloatPair>(&value)) {
    kind(Kind::number);
    write("value", pair->first);
    write("value", pair->second);
  } else {
    kind(Kind::text);
    put_text(out, std::get<std::string>(value));
  }
}

std::optional<Value> read_value(wire::Reader& reader, Key key) {
  auto kind = static_cast<Kind>(0xFF);
  reader("kind", kind);
  std::int32_t integer = 0;
  float number = 0, second = 0;
  switch (kind) {
    case Kind::integer:
      reader("value", integer);
      return reader.ok() ? std::optional<Value>(integer) : std::nullopt;
    case Kind::number:
      reader("value", number);  // Key::range has two numbers after one kind byte
      if (key == Key::range) {
        reader("value", second);
        return reader.ok() ? std::optional<Value>(FloatPair{number, second}) : std::nullopt;
      }
      return reader.ok() ? std::optional<Value>(number) : std::nullopt;
    case Kind::text: {
      std::string text = read_text(reader, "value");
      return reader.ok() ? std::optional<Value>(std::move(text)) : std::nullopt;
    }
  }
  return std::nullopt;
}

wire::Bytes make_header(FrameType type, std::uint32_t request_id, std::size_t payload_length) {
  return wire::bytes_of(
      FrameHeader{.type = type, .request_id = request_id, .payload_length = static_cast<std::uint32_t>(payload_length)});
}

wire::Bytes make_frame(FrameType type, std::uint32_t request_id, wire::BytesView payload) {
  wire::Bytes frame = make_header(type, request_id, payload.size());
  frame.insert(frame.end(), payload.begin(), payload.end());
  return frame;
}

wire::Bytes make_error(std::uint32_t request_id, Code code, std::string_view text) {
  wire::Bytes payload;
  const Put write(payload);
  write("code", code);
  put_text(payload, text);
  return make_frame(FrameType::error, request_id, payload);
}

void Framer::append(wire::BytesView received) {
  if (!broken_.empty()) return;
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  buffer_.insert(buffer_.end(), received.begin(), received.end());
}

std::optional<Frame> Framer::next() {
  const wire::BytesView left = wire::BytesView(buffer_).subspan(begin_);
  if (!broken_.empty() || left.size() < header_size) return std::nullopt;
  Frame frame;
  wire::Reader reader(left.first(header_size));
  fields(reader, frame.header);
  // The length in a damaged frame may be wrong, so the start of the next frame is unknown and the connection ends.
  if (frame.header.magic != magic) {
    broken_ = "is not a BVE1 link: a frame has another magic number";
    return std::nullopt;
  }
  if (frame.header.payload_length > longest_) {
    broken_ = "has a payload of " + std::to_string(frame.header.payload_length) + " bytes, at most " + std::to_string(longest_) +
              " are accepted";
    return std::nullopt;
  }
  if (left.size() < header_size + frame.header.payload_length) return std::nullopt;
  frame.payload = left.subspan(header_size, frame.header.payload_length);
  begin_ += header_size + frame.header.payload_length;
  return frame;
}

wire::Bytes deflated(wire::BytesView plain) {
  // zlib has its own byte type. Copying the bytes avoids casts of buffers.
  std::vector<Bytef> in(plain.size()), out(compressBound(static_cast<uLong>(plain.size())));
  if (!plain.empty()) std::memcpy(in.data(), plain.data(), plain.size());
  auto size = static_cast<uLongf>(out.size());
  if (compress2(out.data(), &size, in.data(), static_cast<uLong>(in.size()), Z_BEST_SPEED) != Z_OK) return {};
  wire::Bytes result(size);
  std::memcpy(result.data(), out.data(), size);
  return result;
}

wire::Bytes inflated(wire::BytesView packed, std::size_t size) {
  // Decompression grows a stream at most 1032-fold (zlib's technical notes). With a wrong size this function must not allocate
  // more.
  constexpr std::size_t largest_ratio = 1032;
  if (size > largest_ratio * packed.size() + 64 || size == 0) return {};
  std::vector<Bytef> in(packed.size()), out(size);
  if (!packed.empty()) std::memcpy(in.data(), packed.data(), packed.size());
  auto made = static_cast<uLongf>(size);
  auto used = static_cast<uLong>(packed.size());
  if (uncompress2(out.data(), &made, in.data(), &used) != Z_OK || made != size || used != packed.size()) return {};
  wire::Bytes result(size);
  std::memcpy(result.data(), out.data(), size);
  return result;
}

}  // namespace sonar::blueview
