// BVE1, our own link between the drop-in SDK libraries and the daemon: frames, their types, and the values inside them.
// The vendor's own protocol is not public and not spoken here. docs/protocols/blueview-link.md describes the link for others.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "protocol/wire/wire.hpp"

namespace sonar::blueview {

inline constexpr std::uint16_t tcp_port = 14750;
inline constexpr std::uint16_t discovery_port = 14751;
inline constexpr std::uint16_t protocol_version = 1;
inline constexpr std::array<std::uint8_t, 4> magic{'B', 'V', 'E', '1'};
inline constexpr std::size_t header_size = 16;
inline constexpr std::size_t longest_payload = 64u << 20;  // of the link
inline constexpr std::size_t longest_request = 70000;      // what a host may send: a text of 65535 bytes fits

/// A reply has the type of its request with this bit set.
inline constexpr std::uint16_t reply_bit = 0x8000;
enum class FrameType : std::uint16_t {
  hello = 0x0001,
  set = 0x0002,
  get = 0x0003,
  ping = 0x0004,
  subscribe = 0x0005,
  keep_alive = 0x0006,
  nav_data = 0x0101,
  event_mark = 0x0102,
  ping_data = 0x8004,
  error = 0xFFFF,
};
constexpr FrameType reply_to(FrameType request) {
  return static_cast<FrameType>(static_cast<std::uint16_t>(request) | reply_bit);
}

/// Codes of the SDK that the link itself produces.
enum class Code : std::int32_t {
  bad_parameter = 6,
  timeout = 18,
  no_head = 2010,
  bad_range = 4009,
  bad_packet_type = 14001,
  bad_packet_version = 14004,
};

struct FrameHeader {
  std::array<std::uint8_t, 4> magic = blueview::magic;
  FrameType type{};
  std::uint16_t flags = 0;
  std::uint32_t request_id = 0;  // 0 = unsolicited
  std::uint32_t payload_length = 0;
};
template <class V, wire::Like<FrameHeader> M>
constexpr void fields(V& visit, M& m) {
  visit("magic", m.magic);
  visit("type", m.type);
  visit("flags", m.flags);
  visit("request_id", m.request_id);
  visit("payload_len", m.payload_length);
}

/// What SET and GET carry: one value, or two floats for Key::range.
struct FloatPair {
  float first = 0, second = 0;
};
using Value = std::variant<std::int32_t, float, std::string, FloatPair>;
enum class Key : std::uint16_t {
  start_range = 1,
  stop_range = 2,
  range = 3,  // two floats
  sound_speed = 4,
  gain = 5,
  tvg = 6,
  fluid = 7,
  transmit = 8,
  ping_interval = 9,
  dynamic_power = 10,
  source_level = 11,
  name = 12,
  local_clock = 13,
};

/// Appends values as a Writer appends fields.
class Put {
 public:
  explicit Put(wire::Bytes& out) : out_(out) {}
  template <class T>
  void operator()(std::string_view name, const T& value) const {
    wire::Writer write(out_);
    write(name, value);
  }

 private:
  wire::Bytes& out_;
};

/// Texts are a 16-bit length and so many bytes of UTF-8; longer ones are cut.
void put_text(wire::Bytes& out, std::string_view text);
std::string take_text(wire::Reader& reader, std::string_view name);
/// Kind byte and value.
void put_value(wire::Bytes& out, const Value& value);
std::optional<Value> take_value(wire::Reader& reader, Key key);

wire::Bytes make_frame(FrameType type, std::uint32_t request_id, wire::BytesView payload);
/// The 16 bytes before a payload of that length.
wire::Bytes make_header(FrameType type, std::uint32_t request_id, std::size_t payload_length);
wire::Bytes make_error(std::uint32_t request_id, Code code, std::string_view text);

struct Frame {
  FrameHeader header;
  wire::BytesView payload;
};

/// Cuts a stream into frames. Anything but a frame ends it: broken() then says why, and nothing more comes out.
class Framer {
 public:
  /// `longest`: payload that is taken; a host passes longest_payload.
  explicit Framer(std::size_t longest = longest_request) : longest_(longest) {}
  void append(wire::BytesView received);
  /// The next whole frame; valid until the next call.
  std::optional<Frame> next();
  const std::string& broken() const { return broken_; }

 private:
  wire::Bytes buffer_;
  std::size_t longest_, begin_ = 0;
  std::string broken_;
};

}  // namespace sonar::blueview
