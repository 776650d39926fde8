// Frames of BVE1 and the values inside them, written and read. BVE1 is sonard's own link between the drop-in SDK libraries and
// the daemon (docs/protocols/blueview-link.md); the vendor's protocol is not public and not implemented here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "protocol/blueview/link.hpp"
#include "protocol/message_fields.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::blueview {

namespace means = protocol::means;

inline constexpr std::size_t longest_request = 70000;  // longest payload of a host; a text of 65535 bytes fits

struct FrameHeader {
  std::array<std::uint8_t, 4> magic = blueview::magic;
  FrameType type{};
  std::uint16_t flags = 0;
  std::uint32_t request_id = 0;  // 0 = unsolicited
  std::uint32_t payload_length = 0;
};
constexpr void fields(auto& visit, wire::Like<FrameHeader> auto& m) {
  visit("magic", m.magic, means::magic);
  visit("type", m.type, means::message_type);
  visit("flags", m.flags);
  visit("request_id", m.request_id);
  visit("payload_len", m.payload_length, means::payload_size);
}

/// The two floats of Key::range. Other keys of SET and GET have one value.
struct FloatPair {
  float first = 0, second = 0;
};
using Value = std::variant<std::int32_t, float, std::string, FloatPair>;

/// Appends single values to a message whose layout depends on its content, so that fields() cannot describe it.
class Put {
 public:
  explicit Put(wire::Bytes& out) : out_(out) {}
  void operator()(std::string_view name, const auto& value) const {
    wire::Writer write(out_);
    write(name, value);
  }

 private:
  wire::Bytes& out_;
};

/// Appends a text: a 16-bit length and that number of bytes of UTF-8. Texts above 65535 bytes are cut.
void put_text(wire::Bytes& out, std::string_view text);
std::string read_text(wire::Reader& reader, std::string_view name);
/// Appends the kind of a value (one byte) and the value.
void put_value(wire::Bytes& out, const Value& value);
std::optional<Value> read_value(wire::Reader& reader, Key key);

wire::Bytes make_frame(FrameType type, std::uint32_t request_id, wire::BytesView payload);
/// Makes the header of a frame (16 bytes) with the given payload length.
wire::Bytes make_header(FrameType type, std::uint32_t request_id, std::size_t payload_length);
wire::Bytes make_error(std::uint32_t request_id, Code code, std::string_view text);

struct Frame {
  FrameHeader header;
  wire::BytesView payload;
};

/// Splits a stream into frames. After bytes that are not a frame, or a frame that is too long, next() always returns nullopt, and
/// broken() returns the reason.
class Framer {
 public:
  /// `longest`: longest accepted payload; a host passes longest_payload.
  explicit Framer(std::size_t longest = longest_request) : longest_(longest) {}
  void append(wire::BytesView received);
  /// Returns the next whole frame, whose payload is valid until the next append().
  std::optional<Frame> next();
  const std::string& broken() const { return broken_; }

 private:
  wire::Bytes buffer_;
  std::size_t longest_, begin_ = 0;
  std::string broken_;
};

/// Returns a zlib stream (RFC 1950), compressed at the fastest level; empty if zlib has no memory.
wire::Bytes deflated(wire::BytesView plain);

/// Decompresses a stream of exactly `size` bytes; returns an empty buffer if it has another size or is damaged.
wire::Bytes inflated(wire::BytesView packed, std::size_t size);

}  // namespace sonar::blueview
