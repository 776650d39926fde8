// Messages of the Example, a sonar for tests only: over TCP, little-endian, a header and a payload.
#pragma once

#include <optional>

#include "protocol/message_fields.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::example_make {

namespace means = protocol::means;

using wire::Bytes;
using wire::BytesView;

inline constexpr std::uint16_t tcp_port = 23000;
inline constexpr std::uint32_t longest_payload = 1 << 20;

enum class Kind : std::uint8_t { settings = 1, accepted = 2, refused = 3, ping = 4 };

struct Header {
  std::array<std::uint8_t, 2> magic{'E', 'X'};
  Kind kind{};
  std::uint8_t version = 1;
  std::uint32_t payload = 0;
};
constexpr void fields(auto& visit, wire::Like<Header> auto& m) {
  visit("magic", m.magic, means::magic);
  visit("kind", m.kind, means::message_type);
  visit("version", m.version, means::version);
  visit("payload", m.payload, means::payload_size);
}

/// Settings from the host. The message `accepted` returns them; `refused` has no payload.
struct Settings {
  std::uint32_t range_mm = 10000;
  std::uint16_t rate_centihz = 0;  // 0: standby
  std::uint8_t gain_percent = 50;
  bool operator==(const Settings&) const = default;
};
constexpr void fields(auto& visit, wire::Like<Settings> auto& m) {
  visit("range_mm", m.range_mm);
  visit("rate_centihz", m.rate_centihz);
  visit("gain_percent", m.gain_percent);
}

/// After it come a bearing to port in 1e-4 rad for each beam (16 bits), and a sample for each row and beam (8 bits).
struct PingHead {
  std::uint32_t number = 0;
  std::uint64_t fired_us = 0;
  std::uint32_t range_mm = 0;
  std::uint16_t beams = 0, rows = 0;
  float frequency_hz = 0;
  std::uint8_t gain_percent = 0;
};
constexpr void fields(auto& visit, wire::Like<PingHead> auto& m) {
  visit("number", m.number, means::ping_id);
  visit("fired_us", m.fired_us, means::time);
  visit("range_mm", m.range_mm, means::range);
  visit("beams", m.beams, means::beams);
  visit("rows", m.rows, means::rows);
  visit("frequency_hz", m.frequency_hz, means::frequency);
  visit("gain_percent", m.gain_percent, means::gain);
}
inline constexpr std::size_t header_size = wire::wire_size<Header>(), head_size = wire::wire_size<PingHead>();
static_assert(header_size == 8 && wire::wire_size<Settings>() == 7 && head_size == 25);

struct PingMessage {
  Header header;
  PingHead head;
};
constexpr void fields(auto& visit, wire::Like<PingMessage> auto& m) {
  visit("header", m.header);
  visit("head", m.head);
}

inline Bytes message(Kind kind, BytesView payload) {
  Bytes bytes = wire::bytes_of(Header{.kind = kind, .payload = static_cast<std::uint32_t>(payload.size())});
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

inline std::optional<std::size_t> length_of(BytesView bytes, recording::Origin, bool strict) {
  Header header;
  wire::Reader reader(bytes);
  fields(reader, header);
  const bool known = header.kind >= Kind::settings && header.kind <= Kind::ping;
  if (!reader.ok() || header.payload > longest_payload || (strict && !known)) return std::nullopt;
  return header_size + header.payload;
}
inline constexpr recording::Framing framing{{'E', 'X'}, header_size, length_of};

/// Returns the kind of a whole message.
inline Kind kind_of(BytesView whole) { return static_cast<Kind>(whole[2]); }
/// Returns the beginning of its payload as an M; empty if the payload is shorter.
template <class M>
std::optional<M> payload_of(BytesView whole) {
  M read;
  wire::Reader reader(whole.subspan(header_size));
  fields(reader, read);
  return reader.ok() ? std::optional(read) : std::nullopt;
}

}  // namespace sonar::example_make
