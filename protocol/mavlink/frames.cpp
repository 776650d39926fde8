#include "protocol/mavlink/frames.hpp"

#include <algorithm>

namespace sonar::mavlink {
namespace {

constexpr std::byte magic_1{0xFE}, magic_2{0xFD};
constexpr std::size_t header_1 = 6, header_2 = 10;  // sizes of the headers, magic included
constexpr std::size_t checksum_size = 2, signature_size = 13;
constexpr std::uint8_t is_signed = 0x01;  // the only incompatibility flag that is supported; signatures are skipped, not verified

/// Table of CRC-16/MCRF4XX, reflected polynomial 0x8408: the CRC of each value of a byte.
constexpr std::array<std::uint16_t, 256> checksum_steps = [] {
  std::array<std::uint16_t, 256> steps{};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    auto crc = static_cast<std::uint16_t>(i);
    for (int bit = 0; bit < 8; ++bit) crc = static_cast<std::uint16_t>((crc >> 1) ^ ((crc & 1) != 0 ? 0x8408 : 0));
    steps[i] = crc;
  }
  return steps;
}();

template <class M>
constexpr MessageInfo info_of() {
  return {M::id, M::name, M::crc_extra, wire::wire_size<M>(), full_size<M>()};
}
constexpr std::array messages_read{
    info_of<Heartbeat>(),        info_of<SystemTime>(),
    info_of<Attitude>(),         info_of<AttitudeQuaternion>(),
    info_of<LocalPositionNed>(), info_of<GlobalPositionInt>(),
    info_of<GpsGlobalOrigin>(),  info_of<VfrHud>(),
    info_of<CommandLong>(),      info_of<VisionPositionEstimate>(),
    info_of<SimState>(),         info_of<AttPosMocap>(),
    info_of<Odometry>(),
};

}  // namespace

std::span<const MessageInfo> known_messages() { return messages_read; }
const MessageInfo* find_message(std::uint32_t id) {
  const auto found = std::find_if(messages_read.begin(), messages_read.end(), [id](const MessageInfo& m) { return m.id == id; });
  return found == messages_read.end() ? nullptr : &*found;
}

std::uint16_t checksum(BytesView bytes, std::uint16_t crc) {
  for (const std::byte b : bytes)
    crc = static_cast<std::uint16_t>((crc >> 8) ^ checksum_steps[(crc ^ std::to_integer<unsigned>(b)) & 0xFF]);
  return crc;
}

/// The header of version 2, as it is written.
struct Header2 {
  std::byte magic{};
  std::uint8_t payload_size = 0;
  std::array<std::uint8_t, 2> flags{};
  std::uint8_t sequence = 0, system = 0, component = 0;
  std::array<std::uint8_t, 3> id{};
};
constexpr void fields(auto& visit, wire::Like<Header2> auto& m) {
  visit("magic", m.magic), visit("len", m.payload_size), visit("flags", m.flags), visit("seq", m.sequence);
  visit("sysid", m.system), visit("compid", m.component), visit("msgid", m.id);
}
static_assert(wire::wire_size<Header2>() == header_2);

struct FrameReader::Header {
  Frame frame;                      // the frame, except for the payload
  std::size_t before = 0, end = 0;  // offsets of the payload, and of the end of the frame with checksum and signature
  bool readable = true;             // false: the frame has an unsupported incompatibility flag
};

/// Returns the header at the front; nullopt if there is none, or if its frame does not fit into the datagram.
std::optional<FrameReader::Header> FrameReader::header() const {
  const auto byte = [this](std::size_t i) { return std::to_integer<std::uint8_t>(rest_[i]); };
  Header h;
  h.frame.version = rest_[0] == magic_1 ? 1 : 2;
  h.before = h.frame.version == 1 ? header_1 : header_2;
  if ((rest_[0] != magic_1 && rest_[0] != magic_2) || rest_.size() < h.before + checksum_size) return std::nullopt;
  h.frame.payload_size = byte(1);
  h.end = h.before + h.frame.payload_size + checksum_size;
  if (h.frame.version == 1) {
    h.frame.sequence = byte(2), h.frame.system = byte(3), h.frame.component = byte(4);
    h.frame.id = byte(5);
  } else {
    const std::uint8_t flags = byte(2);
    h.readable = (flags & ~is_signed) == 0;
    if ((flags & is_signed) != 0) h.end += signature_size;
    h.frame.sequence = byte(4), h.frame.system = byte(5), h.frame.component = byte(6);
    h.frame.id = byte(7) | static_cast<std::uint32_t>(byte(8)) << 8 | static_cast<std::uint32_t>(byte(9)) << 16;
  }
  if (h.end > rest_.size()) return std::nullopt;
  return h;
}

bool FrameReader::begins_a_frame(std::size_t at) const {
  return at == rest_.size() || rest_[at] == magic_1 || rest_[at] == magic_2;
}

/// Returns the frame if it is valid; otherwise counts the error. A frame with a wrong size is skipped completely, and so is an
/// unknown message before another frame or the end. In other cases one byte is skipped, because a frame may begin after it.
std::optional<Frame> FrameReader::checked(const Header& h) {
  const MessageInfo* const message = find_message(h.frame.id);
  if (message == nullptr || !h.readable) {
    const bool whole = begins_a_frame(h.end);
    ++(whole ? counts_.unknown : counts_.junk_bytes);
    skip(whole ? h.end : 1);
    return std::nullopt;
  }
  const std::size_t checksum_at = h.before + h.frame.payload_size;
  // The checksum ends with the CRC_EXTRA of the message, so a dialect in which this number has another layout fails here.
  const std::uint16_t is = checksum(std::array{std::byte{message->crc_extra}}, checksum(rest_.subspan(1, checksum_at - 1)));
  const auto stated = std::to_integer<unsigned>(rest_[checksum_at]) | std::to_integer<unsigned>(rest_[checksum_at + 1]) << 8;
  if (is != stated) {
    ++counts_.bad_checksum;
    skip(1);
    return std::nullopt;
  }
  Frame frame = h.frame;
  const BytesView payload = rest_.subspan(h.before, h.frame.payload_size);
  skip(h.end);
  if (frame.version == 1 && frame.payload_size != message->size) {
    ++counts_.wrong_size;
    return std::nullopt;
  }
  std::copy(payload.begin(), payload.end(), frame.payload.begin());
  ++counts_.frames;
  return frame;
}

std::optional<Frame> FrameReader::next() {
  while (!rest_.empty()) {
    const auto h = header();
    if (!h) {
      ++counts_.junk_bytes;
      skip(1);
    } else if (auto frame = checked(*h)) {
      return frame;
    }
  }
  return std::nullopt;
}

Bytes framed(std::uint32_t id, std::uint8_t crc_extra, BytesView payload, Identity& sender) {
  payload = payload.first(std::min(payload.size(), largest_payload));
  // MAVLink 2 omits zeros at the end of a payload, but keeps the first byte.
  while (payload.size() > 1 && payload.back() == std::byte{0}) payload = payload.first(payload.size() - 1);
  Bytes out;
  out.reserve(header_2 + largest_payload + checksum_size);
  Header2 header{magic_2, static_cast<std::uint8_t>(payload.size()), {}, sender.sequence++, sender.system, sender.component, {}};
  header.id = {static_cast<std::uint8_t>(id), static_cast<std::uint8_t>(id >> 8), static_cast<std::uint8_t>(id >> 16)};
  wire::append(out, header);
  out.insert(out.end(), payload.begin(), payload.end());
  const std::uint16_t crc = checksum(std::array{std::byte{crc_extra}}, checksum(BytesView(out).subspan(1)));
  out.push_back(static_cast<std::byte>(crc & 0xFF));
  out.push_back(static_cast<std::byte>(crc >> 8));
  return out;
}

}  // namespace sonar::mavlink
