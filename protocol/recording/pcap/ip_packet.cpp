#include "protocol/recording/pcap/ip_packet.hpp"

#include <algorithm>

#include "core/text/ipv4.hpp"
#include "protocol/recording/pcap/numbers_at.hpp"

namespace sonar::recording {
namespace {

using wire::BytesView;

// LINKTYPE_ numbers of tcpdump.org; EtherTypes and IP protocols of IANA.
constexpr std::uint32_t null_link = 0, ethernet = 1, raw_bsd = 12, raw_openbsd = 14, raw_ip = 101, loop_link = 108, cooked = 113,
                        ipv4 = 228, cooked2 = 276;
constexpr std::uint16_t ip_type = 0x0800, vlan_type = 0x8100, provider_type = 0x88A8;
constexpr unsigned tcp_protocol = 6, udp_protocol = 17;

unsigned u8_at(BytesView bytes, std::size_t offset) {
  return offset < bytes.size() ? std::to_integer<unsigned>(bytes[offset]) : 0;
}

/// The packet in an Ethernet frame, behind any number of VLAN tags.
std::optional<BytesView> behind_ethernet(BytesView frame) {
  std::size_t at = 12;
  while (u16_at(frame, at) == vlan_type || u16_at(frame, at) == provider_type) at += 4;
  if (u16_at(frame, at) != ip_type || frame.size() < at + 2) return std::nullopt;
  return frame.subspan(at + 2);
}

std::optional<BytesView> behind(BytesView frame, std::size_t header, bool is_ip) {
  if (!is_ip || frame.size() < header) return std::nullopt;
  return frame.subspan(header);
}

std::optional<BytesView> ip_packet(std::uint32_t link_type, BytesView frame) {
  switch (link_type) {
    case ethernet:
      return behind_ethernet(frame);
    case raw_ip:
    case raw_bsd:
    case raw_openbsd:
    case ipv4:
      return frame;
    case cooked:
      return behind(frame, 16, u16_at(frame, 14) == ip_type);
    case cooked2:
      return behind(frame, 20, u16_at(frame, 0) == ip_type);
    case null_link:  // address family 2 (IPv4) in the byte order of the computer that captured
      return behind(frame, 4, u32_at(frame, 0) == 2 || u32_at(frame, 0) == 0x02000000);
    case loop_link:
      return behind(frame, 4, u32_at(frame, 0) == 2);
    default:
      return std::nullopt;
  }
}

/// RFC 9293, 3.1: sequence number at offset 4, length of the header in words in the upper half of byte 12, flags in byte 13.
std::optional<Segment> tcp_segment(Segment found, BytesView body) {
  const std::size_t header = (u8_at(body, 12) >> 4) * std::size_t{4};
  if (header < 20 || body.size() < header) return std::nullopt;
  found.sequence = u32_at(body, 4);
  found.flags = static_cast<std::uint8_t>(u8_at(body, 13));
  found.payload = body.subspan(header);
  return found;
}

/// RFC 768: length at offset 4, payload from offset 8. The capture may have cut the payload.
std::optional<Segment> udp_datagram(Segment found, BytesView body) {
  const std::size_t size = u16_at(body, 4);
  if (body.size() < 8 || size < 8) return std::nullopt;
  found.tcp = false;
  found.payload = body.subspan(8, std::min(size, body.size()) - 8);
  return found;
}

}  // namespace

std::string text_of(const IpEnd& end) {
  return text::format_ipv4(text::ipv4_from_number(end.address)) + ":" + std::to_string(end.port);
}

bool is_known_link_type(std::uint32_t link_type) {
  constexpr std::uint32_t known[] = {null_link, ethernet, raw_bsd, raw_openbsd, raw_ip, loop_link, cooked, ipv4, cooked2};
  return std::find(std::begin(known), std::end(known), link_type) != std::end(known);
}

// RFC 791: bit "more fragments" and offset 0. Only first fragments are counted, so that each datagram counts once.
bool begins_fragments(std::uint32_t link_type, BytesView packet) {
  const auto ip = ip_packet(link_type, packet);
  return ip && ip->size() >= 20 && u8_at(*ip, 0) >> 4 == 4 && (u16_at(*ip, 6) & 0x3FFFu) == 0x2000;
}

std::optional<Segment> parse_packet(std::uint32_t link_type, BytesView packet) {
  const auto ip = ip_packet(link_type, packet);
  if (!ip || ip->size() < 20 || u8_at(*ip, 0) >> 4 != 4) return std::nullopt;
  const std::size_t header = (u8_at(*ip, 0) & 0x0Fu) * std::size_t{4};
  // With segmentation offload a captured segment may be too long for the 16-bit field, which is then 0.
  const std::size_t total = u16_at(*ip, 2) == 0 ? ip->size() : std::min<std::size_t>(u16_at(*ip, 2), ip->size());
  const bool is_fragment = (u16_at(*ip, 6) & 0x3FFFu) != 0;
  if (header < 20 || total < header || is_fragment) return std::nullopt;
  const BytesView body = ip->subspan(header, total - header);
  if (body.size() < 4) return std::nullopt;
  Segment found;
  found.source = {u32_at(*ip, 12), u16_at(body, 0)};
  found.target = {u32_at(*ip, 16), u16_at(body, 2)};
  if (u8_at(*ip, 9) == tcp_protocol) return tcp_segment(found, body);
  if (u8_at(*ip, 9) == udp_protocol) return udp_datagram(found, body);
  return std::nullopt;
}

}  // namespace sonar::recording
