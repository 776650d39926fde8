// Captures as recordings: reads the messages of a sonar and its clients from a capture file and writes them into one.
// Written files have generated packet headers, so that Wireshark shows them as a live connection.
#pragma once

#include <memory>
#include <optional>

#include "protocol/host.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"
#include "protocol/recording/pcap/ip_packet.hpp"

namespace sonar::recording {

struct PcapReading {
  std::optional<std::uint32_t> device;  // address of the device, if the capture has several sonars; else the one that sent most
};
/// All connections of one sonar, one after the other, and its status datagrams; of one that sends its pings by UDP all its
/// datagrams. Reads the file once to find the sonar: of those that send messages of a make the one at that make's port, else the
/// one that sent most. bad_data: none found.
Result<std::unique_ptr<RecordingReader>> read_pcap(std::unique_ptr<Source> source, const PcapReading& reading = {});

struct PcapConversation {
  IpEnd device{0x7F000002, 52100}, client{0x7F000001, 40000};
  IpEnd status_from{0x7F000002, 52102}, status_to{0xFFFFFFFF, 52102};
  std::uint32_t first_device_sequence = 1'000'000, first_client_sequence = 2'000'000;
};
/// The ends of a sonar of this make and of its usual host.
PcapConversation usual_ends(const protocol::Make& make, std::uint32_t device = 0x7F000002, std::uint32_t client = 0x7F000001);
/// Classic pcap, nanoseconds, raw IP. One connection from its SYN to its FIN; messages in segments of at most 65,495 bytes.
std::unique_ptr<RecordingWriter> write_pcap(std::unique_ptr<Sink> sink, const PcapConversation& conversation);

}  // namespace sonar::recording
