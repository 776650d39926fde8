// Reads the packets of a capture file (classic pcap or pcapng). First step of reading a capture; parse_packet() decodes them.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/units.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::recording {

struct Packet {
  Time at{};
  std::uint32_t link_type = 0;  // LINKTYPE_ number
  BytesView bytes;              // captured bytes, valid until the next call
};

/// Reads pcap in either byte order, with micro- or nanoseconds, and of pcapng the sections, the interfaces with their time units,
/// and enhanced and simple packets; other blocks are skipped.
class PacketReader {
 public:
  static constexpr std::size_t longest_packet = 256 << 10;  // limit of tcpdump
  /// Opens a capture. Errors: bad_data if the source is not a capture file.
  static Result<PacketReader> open(Source& source);

  std::optional<Packet> next();
  /// Returns the skipped blocks, and the position at which the file became unreadable.
  const Damages& damages() const { return damages_; }
  void rewind();

 private:
  struct Interface {
    std::uint32_t link_type = 0;
    std::uint64_t ticks_per_s = 1'000'000;
  };
  explicit PacketReader(Source& source) : scan_(source) {}
  bool read_front();
  std::optional<Packet> next_classic();
  std::optional<Packet> next_block();
  std::optional<Packet> enhanced(BytesView body) const;
  std::optional<Packet> simple(BytesView body) const;
  bool begin_section(std::uint64_t at);
  void add_interface(BytesView body);
  std::nullopt_t stop(std::string why);

  Scan scan_;
  bool ng_ = false;
  wire::Endian endian_ = wire::Endian::little;
  std::vector<Interface> interfaces_;
  Damages damages_;
};

// Reads integers at any offset of a block of bytes; 0 if the block is too short. Used for the headers of packets and of capture
// files.

template <class T>
T number_at(wire::BytesView bytes, std::size_t offset, wire::Endian endian) {
  T value = 0;
  wire::Reader reader(bytes.subspan(std::min(offset, bytes.size())), endian);
  reader("number", value);
  return value;
}
inline std::uint16_t u16_at(wire::BytesView bytes, std::size_t offset, wire::Endian endian = wire::Endian::big) {
  return number_at<std::uint16_t>(bytes, offset, endian);
}
inline std::uint32_t u32_at(wire::BytesView bytes, std::size_t offset, wire::Endian endian = wire::Endian::big) {
  return number_at<std::uint32_t>(bytes, offset, endian);
}

// Extracts the TCP segment or UDP datagram of a captured packet. Second step of reading a capture; TcpStream orders segments.

struct IpEnd {
  std::uint32_t address = 0;  // such as 0x7F000002 for 127.0.0.2
  std::uint16_t port = 0;
  auto operator<=>(const IpEnd&) const = default;
};
std::string text_of(const IpEnd& end);  // returns a text such as "127.0.0.2:52100"

namespace tcp_flag {
inline constexpr std::uint8_t fin = 0x01, syn = 0x02, rst = 0x04, psh = 0x08, ack = 0x10;
}

struct Segment {
  bool tcp = true;  // false: UDP
  IpEnd source, target;
  std::uint32_t sequence = 0;
  std::uint8_t flags = 0;
  wire::BytesView payload;  // captured part of the payload
};

/// Decodes packets of the link types Ethernet (with VLAN tags), raw IP, Linux cooked 1 and 2, BSD loopback. Returns nullopt for
/// other protocols, IPv6, fragments, and cut headers.
std::optional<Segment> parse_packet(std::uint32_t link_type, wire::BytesView packet);

/// True if the packet is the first fragment of an IPv4 datagram.
bool begins_fragments(std::uint32_t link_type, wire::BytesView packet);

/// True for link types that parse_packet supports.
bool is_known_link_type(std::uint32_t link_type);

// Reassembles one direction of a TCP connection: drops retransmitted bytes, holds early segments, reports lost segments. Third
// step of reading a capture; its output goes to a MessageSplitter.

class TcpStream {
 public:
  static constexpr std::size_t most_waiting_bytes = 8u << 20;  // early segments; beyond this the missing bytes count as lost
  static constexpr std::size_t most_waiting = 8192;

  struct Run {
    Time at{};
    wire::Bytes bytes;
    std::uint64_t missing_before = 0;  // bytes that the capture lacks here
    bool from_middle = false;          // true: the capture began after the start of the connection
  };

  /// Adds a segment. `sequence`: the sequence number of its first byte or, in a SYN, of the SYN.
  void add(Time at, std::uint32_t sequence, wire::BytesView payload, bool syn);
  /// Ends the connection or the capture: releases held segments.
  void finish();
  std::optional<Run> next();
  /// Returns the memory of early segments, including overhead.
  std::size_t held_bytes() const { return waiting_bytes_ + waiting_.size() * 128; }
  /// True if a SYN with this number begins another connection.
  bool is_other(std::uint32_t syn_sequence) const { return begun_ && (!saw_syn_ || first_ != syn_sequence + 1); }

 private:
  struct Early {
    Time at{};
    wire::Bytes bytes;
  };
  void begin(std::uint32_t sequence, bool syn);
  void give(Time at, wire::BytesView bytes);
  void give_what_follows();
  void skip_to_first_waiting();

  bool begun_ = false, saw_syn_ = false, from_middle_ = false;
  std::uint32_t first_ = 0;     // sequence number of the first byte
  std::uint64_t position_ = 0;  // position of the next byte, counted from the first
  std::uint64_t missing_ = 0;
  std::map<std::uint64_t, Early> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::deque<Run> ready_;
};

}  // namespace sonar::recording
