// Reads and writes captures: the messages of a sonar and its clients. Written files have generated packet headers, so that
// Wireshark shows a live connection.
#pragma once

#include <memory>
#include <optional>

#include "protocol/host.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"
#include "protocol/recording/pcap/packets.hpp"

namespace sonar::recording {

struct PcapReading {
  std::optional<std::uint32_t> device;  // address of the device; nullopt: read_pcap() selects the sonar
};
/// Reads all connections of one sonar in the order of the capture, and its status datagrams; if it sends pings over UDP, all its
/// datagrams. First reads the file once to find the sonar: of the senders of a make's messages, one at the make's port, else the
/// one that sent most bytes. Errors: bad_data if there is none.
Result<std::unique_ptr<RecordingReader>> read_pcap(std::unique_ptr<Source> source, const PcapReading& reading = {});

struct PcapConversation {
  IpEnd device{0x7F000002, 52100}, client{0x7F000001, 40000};
  IpEnd status_from{0x7F000002, 52102}, status_to{0xFFFFFFFF, 52102};
  std::uint32_t first_device_sequence = 1'000'000, first_client_sequence = 2'000'000;
};
/// Returns the addresses and ports of a sonar of this make and of a usual host.
PcapConversation usual_ends(const protocol::Make& make, std::uint32_t device = 0x7F000002, std::uint32_t client = 0x7F000001);
/// Writes classic pcap with nanoseconds and raw IP: one connection from its SYN to its FIN, messages in segments of at most
/// 65,495 bytes.
std::unique_ptr<RecordingWriter> write_pcap(std::unique_ptr<Sink> sink, const PcapConversation& conversation);

}  // namespace sonar::recording
