#include "protocol/recording/pcap/packets.hpp"

#include <utility>

#include "core/text/ipv4.hpp"

namespace sonar::recording {
namespace {

constexpr std::uint32_t micro_magic = 0xA1B2C3D4, nano_magic = 0xA1B23C4D, section_magic = 0x0A0D0D0A, order_magic = 0x1A2B3C4D;
constexpr std::size_t most_interfaces = 1024;
constexpr std::size_t most_block = PacketReader::longest_packet + 4096;  // limit for a packet with its options
constexpr std::uint32_t interface_block = 1, simple_block = 3, enhanced_block = 6;
constexpr std::uint16_t end_option = 0, resolution_option = 9;

Time time_of(std::uint64_t ticks, std::uint64_t ticks_per_s) {
  const std::uint64_t whole_s = ticks / ticks_per_s, rest = ticks % ticks_per_s;
  if (whole_s > 4'000'000'000u) return {};  // a time in 2096 or later is damage
  const double rest_ns = 1e9 * static_cast<double>(rest) / static_cast<double>(ticks_per_s);
  return Time(std::chrono::seconds(whole_s) + std::chrono::nanoseconds(static_cast<std::int64_t>(rest_ns)));
}

/// Returns the unit of an interface's times in pcapng: a power of ten, or of two if the top bit is set. A unit finer than 10^-18
/// s is damage and counts as a microsecond.
std::uint64_t ticks_per_s(unsigned resolution) {
  const unsigned base = (resolution & 0x80u) != 0 ? 2 : 10, exponent = resolution & 0x7Fu;
  std::uint64_t ticks = 1;
  for (unsigned i = 0; i < exponent; ++i) {
    if (ticks > 1'000'000'000'000'000'000u / base) return 1'000'000;
    ticks *= base;
  }
  return ticks;
}

}  // namespace

std::nullopt_t PacketReader::stop(std::string why) {
  damages_.add(std::move(why));
  scan_.seek(scan_.position() + scan_.left());
  return std::nullopt;
}

Result<PacketReader> PacketReader::open(Source& source) {
  PacketReader reader(source);
  if (!reader.read_front()) return failure(ErrorKind::bad_data, source.name() + " is not a capture file (pcap or pcapng)");
  return reader;
}

void PacketReader::rewind() {
  scan_.seek(0);
  damages_.clear();
  read_front();
}

bool PacketReader::read_front() {
  interfaces_.clear();
  const BytesView magic = scan_.peek(4);
  if (magic.size() < 4) return false;
  ng_ = u32_at(magic, 0, wire::Endian::little) == section_magic;
  if (ng_) return true;
  for (const auto endian : {wire::Endian::little, wire::Endian::big}) {
    const std::uint32_t found = u32_at(magic, 0, endian);
    if (found != micro_magic && found != nano_magic) continue;
    const BytesView header = scan_.read(24);
    if (header.size() < 24) return false;
    endian_ = endian;
    // The lower 16 bits are the link type; the upper bits state the length of the frame checksum.
    interfaces_.push_back({u32_at(header, 20, endian) & 0xFFFFu, found == nano_magic ? 1'000'000'000u : 1'000'000u});
    return true;
  }
  return false;
}

std::optional<Packet> PacketReader::next() {
  if (scan_.left() == 0) return std::nullopt;
  return ng_ ? next_block() : next_classic();
}

// The header of a packet has 16 bytes: seconds, micro- or nanoseconds, captured length, length on the wire. There is no mark with
// which a reader could find the next packet after a damaged length, so reading ends there.
std::optional<Packet> PacketReader::next_classic() {
  const std::string at = "byte " + std::to_string(scan_.position());
  const BytesView header = scan_.read(16);
  if (header.size() < 16) return stop("the packet at " + at + " is cut short by the end of the file");
  const std::uint32_t whole_s = u32_at(header, 0, endian_), rest = u32_at(header, 4, endian_), size = u32_at(header, 8, endian_);
  if (size == 0 && u32_at(header, 12, endian_) == 0)  // zeros of a file that a crash left incomplete
    return stop("the packet at " + at + " has a length of 0 bytes on the wire");
  if (size > longest_packet) return stop("the packet at " + at + " would have " + std::to_string(size) + " bytes");
  const std::uint64_t per_s = interfaces_.front().ticks_per_s;
  const BytesView bytes = scan_.read(size);
  if (bytes.size() < size) return stop("the packet at " + at + " is cut short by the end of the file");
  return Packet{time_of(whole_s * per_s + rest, per_s), interfaces_.front().link_type, bytes};
}

/// Reads the byte order of a section, which the number at offset 8 shows. Each section has its own interfaces.
bool PacketReader::begin_section(std::uint64_t at) {
  scan_.seek(at);
  const BytesView front = scan_.peek(12);
  if (front.size() < 12) return false;
  for (const auto endian : {wire::Endian::little, wire::Endian::big}) {
    if (u32_at(front, 8, endian) != order_magic) continue;
    endian_ = endian;
    interfaces_.clear();
    return true;
  }
  return false;
}

/// Reads an interface description: link type, and from the options the unit of its times (a microsecond without that option).
void PacketReader::add_interface(BytesView body) {
  if (interfaces_.size() >= most_interfaces) return;
  Interface made{u16_at(body, 0, endian_), 1'000'000};
  for (std::size_t at = 8; at + 4 <= body.size();) {
    const std::uint16_t code = u16_at(body, at, endian_), size = u16_at(body, at + 2, endian_);
    if (code == end_option || at + 4 + size > body.size()) break;
    if (code == resolution_option && size >= 1) made.ticks_per_s = ticks_per_s(std::to_integer<unsigned>(body[at + 4]));
    at += 4 + (size + 3u) / 4 * 4;  // values are padded to 4 bytes
  }
  interfaces_.push_back(made);
}

/// Reads a packet with interface, time and captured length. Returns nullopt if its numbers contradict each other.
std::optional<Packet> PacketReader::enhanced(BytesView body) const {
  const std::uint32_t interface = u32_at(body, 0, endian_), size = u32_at(body, 12, endian_);
  if (body.size() < 20 || interface >= interfaces_.size() || size > body.size() - 20) return std::nullopt;
  const std::uint64_t ticks = std::uint64_t{u32_at(body, 4, endian_)} << 32 | u32_at(body, 8, endian_);
  const Interface& from = interfaces_[interface];
  return Packet{time_of(ticks, from.ticks_per_s), from.link_type, body.subspan(20, size)};
}

std::optional<Packet> PacketReader::simple(BytesView body) const {
  if (body.size() < 4 || interfaces_.empty()) return std::nullopt;
  const std::size_t size = std::min<std::size_t>(u32_at(body, 0, endian_), body.size() - 4);
  return Packet{{}, interfaces_.front().link_type, body.subspan(4, size)};  // simple packets have no time
}

std::optional<Packet> PacketReader::next_block() {
  while (scan_.left() > 0) {
    const std::uint64_t at = scan_.position();
    const std::string place = "the block at byte " + std::to_string(at);
    if (u32_at(scan_.peek(4), 0, endian_) == section_magic && !begin_section(at)) return stop(place + " begins no section");
    const BytesView front = scan_.read(8);
    const std::uint32_t type = u32_at(front, 0, endian_), size = u32_at(front, 4, endian_);
    if (front.size() < 8 || (size >= 12 && size - 8 > scan_.left())) return stop(place + " is cut short by the end of the file");
    if (size < 12 || size % 4 != 0) return stop(place + " has an impossible length, " + std::to_string(size));
    if (type != interface_block && type != simple_block && type != enhanced_block) {
      scan_.skip(size - 8);
      continue;
    }
    if (size > most_block) return stop(place + " would have " + std::to_string(size) + " bytes");
    const BytesView rest = scan_.read(size - 8);
    const BytesView body = rest.first(rest.size() - 4);  // the length at the start of a block is repeated at its end
    if (u32_at(rest, body.size(), endian_) != size) return stop(place + " does not repeat its length at its end");
    if (type == interface_block) {
      add_interface(body);
      continue;
    }
    if (auto packet = type == enhanced_block ? enhanced(body) : simple(body)) return packet;
    damages_.add("the packet block at byte " + std::to_string(at) + " has an inconsistent length");
  }
  return std::nullopt;
}

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

/// Returns the packet in an Ethernet frame, after any number of VLAN tags.
std::optional<BytesView> after_ethernet(BytesView frame) {
  std::size_t at = 12;
  while (u16_at(frame, at) == vlan_type || u16_at(frame, at) == provider_type) at += 4;
  if (u16_at(frame, at) != ip_type || frame.size() < at + 2) return std::nullopt;
  return frame.subspan(at + 2);
}

std::optional<BytesView> after_header(BytesView frame, std::size_t header, bool is_ip) {
  if (!is_ip || frame.size() < header) return std::nullopt;
  return frame.subspan(header);
}

std::optional<BytesView> ip_packet(std::uint32_t link_type, BytesView frame) {
  switch (link_type) {
    case ethernet:
      return after_ethernet(frame);
    case raw_ip:
    case raw_bsd:
    case raw_openbsd:
    case ipv4:
      return frame;
    case cooked:
      return after_header(frame, 16, u16_at(frame, 14) == ip_type);
    case cooked2:
      return after_header(frame, 20, u16_at(frame, 0) == ip_type);
    case null_link:  // address family 2 (IPv4) in the byte order of the computer that captured
      return after_header(frame, 4, u32_at(frame, 0) == 2 || u32_at(frame, 0) == 0x02000000);
    case loop_link:
      return after_header(frame, 4, u32_at(frame, 0) == 2);
    default:
      return std::nullopt;
  }
}

/// Reads a TCP header (RFC 9293, 3.1): sequence number at offset 4, length of the header in words in the upper half of byte 12,
/// flags in byte 13.
std::optional<Segment> tcp_segment(Segment found, BytesView body) {
  const std::size_t header = (u8_at(body, 12) >> 4) * std::size_t{4};
  if (header < 20 || body.size() < header) return std::nullopt;
  found.sequence = u32_at(body, 4);
  found.flags = static_cast<std::uint8_t>(u8_at(body, 13));
  found.payload = body.subspan(header);
  return found;
}

/// Reads a UDP header (RFC 768): length at offset 4, payload from offset 8. The capture may have cut the payload.
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

void TcpStream::begin(std::uint32_t sequence, bool syn) {
  begun_ = true;
  saw_syn_ = syn;
  first_ = syn ? sequence + 1 : sequence;
  from_middle_ = !syn;
}

void TcpStream::add(Time at, std::uint32_t sequence, wire::BytesView payload, bool syn) {
  if (!begun_) {
    if (!syn && payload.empty()) return;
    begin(sequence, syn);
  }
  if (payload.empty()) return;
  // Sequence numbers wrap after 4 GiB. The difference as a signed number is right for segments up to 2 GiB early or late.
  const auto expected = static_cast<std::uint32_t>(first_ + position_);
  const auto ahead = static_cast<std::int32_t>(sequence + (syn ? 1u : 0u) - expected);
  if (ahead <= 0) {  // a segment that continues the stream, or repeats bytes of it
    const auto known = static_cast<std::size_t>(-static_cast<std::int64_t>(ahead));
    if (known >= payload.size()) return;
    give(at, payload.subspan(known));
    return give_what_follows();
  }
  // An early segment waits for the preceding ones. Of two segments at the same place the longer is kept.
  Early& early = waiting_[position_ + static_cast<std::uint32_t>(ahead)];
  if (early.bytes.size() >= payload.size()) return;
  waiting_bytes_ += payload.size() - early.bytes.size();
  early = {at, {payload.begin(), payload.end()}};
  // If too many bytes or segments wait, the preceding bytes are assumed to be missing from the capture, and are skipped.
  if (waiting_bytes_ > most_waiting_bytes || waiting_.size() > most_waiting) {
    skip_to_first_waiting();
    give_what_follows();
  }
}

void TcpStream::give(Time at, wire::BytesView bytes) {
  ready_.push_back({at, {bytes.begin(), bytes.end()}, std::exchange(missing_, 0), std::exchange(from_middle_, false)});
  position_ += bytes.size();
}

/// Moves early segments that now continue the stream to `ready_`, without the bytes that are already known.
void TcpStream::give_what_follows() {
  while (!waiting_.empty() && waiting_.begin()->first <= position_) {
    const Early early = std::move(waiting_.begin()->second);
    const std::uint64_t known = position_ - waiting_.begin()->first;
    waiting_.erase(waiting_.begin());
    waiting_bytes_ -= early.bytes.size();
    if (known < early.bytes.size()) give(early.at, wire::BytesView(early.bytes).subspan(static_cast<std::size_t>(known)));
  }
}

void TcpStream::skip_to_first_waiting() {
  if (waiting_.empty() || waiting_.begin()->first <= position_) return;
  missing_ += waiting_.begin()->first - position_;
  position_ = waiting_.begin()->first;
}

void TcpStream::finish() {
  while (!waiting_.empty()) {
    skip_to_first_waiting();
    give_what_follows();
  }
}

std::optional<TcpStream::Run> TcpStream::next() {
  if (ready_.empty()) return std::nullopt;
  Run run = std::move(ready_.front());
  ready_.pop_front();
  return run;
}

}  // namespace sonar::recording
