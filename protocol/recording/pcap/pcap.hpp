// Captures as recordings: what a sonar and its clients sent each other, out of the packets of a capture file and into one.
// Written ones have headers made here, so that Wireshark shows them as it would a live connection.
#pragma once

#include <memory>
#include <optional>

#include "protocol/recording/pcap/ip_packet.hpp"
#include "protocol/recording/piece.hpp"
#include "protocol/recording/store.hpp"

namespace sonar::recording {

struct PcapReading {
  std::optional<std::uint32_t> device;  // its address, when the capture holds several sonars; else the one that sent most
};
/// All connections of one sonar, one after the other, and its status datagrams. Reads the file once to find the sonar: the end of
/// TCP port 52100, or one that sends Oculus messages. bad_data when there is none.
Result<std::unique_ptr<PieceReader>> read_pcap(std::unique_ptr<Source> source, const PcapReading& reading = {});

struct PcapConversation {
  IpEnd device{0x7F000002, 52100}, client{0x7F000001, 40000};
  IpEnd status_from{0x7F000002, 52102}, status_to{0xFFFFFFFF, 52102};
  std::uint32_t first_device_sequence = 1'000'000, first_client_sequence = 2'000'000;
};
/// Classic pcap, nanoseconds, raw IP. One connection from its SYN to its FIN; messages in segments of at most 65,495 bytes.
std::unique_ptr<PieceWriter> write_pcap(std::unique_ptr<Sink> sink, const PcapConversation& conversation);

}  // namespace sonar::recording
