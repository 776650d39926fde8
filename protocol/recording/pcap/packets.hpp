// Reads the packets of a capture file (classic pcap or pcapng). First step of reading a capture; ip_packet.hpp decodes them.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

struct Packet {
  Time at{};
  std::uint32_t link_type = 0;  // LINKTYPE_ number
  BytesView bytes;              // as captured; valid until the next call
};

/// pcap: seconds and micro- or nanoseconds, either byte order. pcapng: sections, interfaces with their own time unit, enhanced
/// and simple packets; other blocks are skipped.
class PacketReader {
 public:
  static constexpr std::size_t longest_packet = 256 << 10;  // tcpdump's own bound
  /// Errors: bad_data if the source is not a capture file.
  static Result<PacketReader> open(Source& source);

  std::optional<Packet> next();
  /// Skipped blocks, and the position at which the file became unreadable.
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

}  // namespace sonar::recording
