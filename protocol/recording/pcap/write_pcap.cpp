#include <algorithm>

#include "core/text/ipv4.hpp"
#include "protocol/recording/pcap/pcap.hpp"

namespace sonar::recording {
namespace {

constexpr std::size_t most_segment = 65'495;  // capacity of an IPv4 packet after two headers of 20 bytes
constexpr std::uint8_t window_scale = 7;      // a window of 8 MB holds any message without an acknowledgement
constexpr std::uint8_t ip_tcp = 6, ip_udp = 17;

struct PcapFileHeader {
  std::uint32_t magic = 0xA1B23C4D;  // nanoseconds
  std::uint16_t major = 2, minor = 4;
  std::uint32_t zone = 0, accuracy = 0, snap_length = 262'144, link_type = 101;  // raw IP
};
constexpr void fields(auto& visit, wire::Like<PcapFileHeader> auto& m) {
  visit("magic", m.magic);
  visit("major", m.major);
  visit("minor", m.minor);
  visit("zone", m.zone);
  visit("accuracy", m.accuracy);
  visit("snapLength", m.snap_length);
  visit("linkType", m.link_type);
}

/// The header of RFC 791, without options. 0x4000 = do not fragment.
struct IpHeader {
  std::uint8_t version_and_length = 0x45, service = 0;
  std::uint16_t total_length = 0, identification = 0, fragment = 0x4000;
  std::uint8_t time_to_live = 64, protocol = ip_tcp;
  std::uint16_t checksum = 0;
  std::uint32_t source = 0, target = 0;
};
constexpr void fields(auto& visit, wire::Like<IpHeader> auto& m) {
  visit("versionAndLength", m.version_and_length);
  visit("service", m.service);
  visit("totalLength", m.total_length);
  visit("identification", m.identification);
  visit("fragment", m.fragment);
  visit("timeToLive", m.time_to_live);
  visit("protocol", m.protocol);
  visit("checksum", m.checksum);
  visit("source", m.source);
  visit("target", m.target);
}

/// The header of RFC 9293, 3.1. 0x50 = five words, without options.
struct TcpHeader {
  std::uint16_t source = 0, target = 0;
  std::uint32_t sequence = 0, acknowledged = 0;
  std::uint8_t length = 0x50, flags = 0;
  std::uint16_t window = 65'535, checksum = 0, urgent = 0;
};
constexpr void fields(auto& visit, wire::Like<TcpHeader> auto& m) {
  visit("source", m.source);
  visit("target", m.target);
  visit("sequence", m.sequence);
  visit("acknowledged", m.acknowledged);
  visit("length", m.length);
  visit("flags", m.flags);
  visit("window", m.window);
  visit("checksum", m.checksum);
  visit("urgent", m.urgent);
}
static_assert(wire::wire_size<PcapFileHeader>() == 24 && wire::wire_size<IpHeader>() == 20 && wire::wire_size<TcpHeader>() == 20);

/// Returns the sum of 16-bit words, big-endian, for the Internet checksum (RFC 1071). checksum_of() adds the carries.
std::uint64_t word_sum(BytesView bytes, std::uint64_t sum = 0) {
  for (std::size_t i = 0; i < bytes.size(); ++i) sum += std::to_integer<std::uint64_t>(bytes[i]) << (i % 2 == 0 ? 8 : 0);
  return sum;
}
std::uint16_t checksum_of(std::uint64_t sum) {
  while (sum >> 16 != 0) sum = (sum & 0xFFFF) + (sum >> 16);
  return static_cast<std::uint16_t>(~sum);
}
void put_u16(Bytes& bytes, std::size_t at, std::uint16_t value) {
  bytes[at] = static_cast<std::byte>(value >> 8);
  bytes[at + 1] = static_cast<std::byte>(value & 0xFF);
}

/// One end of the connection, and the sequence number of the next byte that it sends.
struct End {
  IpEnd place;
  std::uint32_t sequence = 0;
};

/// Writes messages as packets of one connection, each acknowledged by the other end, and datagrams as UDP packets.
class PcapWriter final : public RecordingWriter {
 public:
  PcapWriter(std::unique_ptr<Sink> sink, const PcapConversation& conversation)
      : sink_(std::move(sink)),
        conversation_(conversation),
        device_{conversation.device, conversation.first_device_sequence},
        client_{conversation.client, conversation.first_client_sequence} {}

  Result<void> write(const RecordedMessage& message) override {
    Bytes packets;
    // If the sink fails, the next message continues from here, as if this message had not been written.
    const auto before = std::tuple(device_, client_, identification_, begun_, connected_);
    last_ = message.at;
    begin(packets);
    if (message.by == Carrier::datagram) {
      datagram(packets, message);
    } else {
      connect(packets);
      End& from = message.from == Origin::device ? device_ : client_;
      End& to = message.from == Origin::device ? client_ : device_;
      for (std::size_t at = 0; at < message.bytes.size(); at += most_segment) {
        const auto part = BytesView(message.bytes).subspan(at, std::min(most_segment, message.bytes.size() - at));
        const bool last = at + part.size() == message.bytes.size();
        segment(packets, from, to, static_cast<std::uint8_t>(tcp_flag::ack | (last ? tcp_flag::psh : 0)), part);
      }
      segment(packets, to, from, tcp_flag::ack, {});
    }
    Result<void> written = sink_->append(packets);
    if (!written) std::tie(device_, client_, identification_, begun_, connected_) = before;
    return written;
  }

  /// Ends the connection with FIN from both sides, so that Wireshark shows it as closed.
  Result<void> close() override {
    Bytes packets;
    begin(packets);
    if (connected_) {
      segment(packets, device_, client_, tcp_flag::fin | tcp_flag::ack, {});
      segment(packets, client_, device_, tcp_flag::fin | tcp_flag::ack, {});
      segment(packets, device_, client_, tcp_flag::ack, {});
    }
    if (Result<void> written = sink_->append(packets); !written) return written;
    return sink_->close();
  }

 private:
  void begin(Bytes& packets) {
    if (!std::exchange(begun_, true)) wire::append(packets, PcapFileHeader{});
  }

  /// Writes the handshake, from which Wireshark reads the window scale.
  void connect(Bytes& packets) {
    if (std::exchange(connected_, true)) return;
    segment(packets, client_, device_, tcp_flag::syn, {});
    segment(packets, device_, client_, tcp_flag::syn | tcp_flag::ack, {});
    segment(packets, client_, device_, tcp_flag::ack, {});
  }

  void segment(Bytes& packets, End& from, const End& to, std::uint8_t flags, BytesView payload) {
    const bool syn = (flags & tcp_flag::syn) != 0;
    TcpHeader header;
    header.source = from.place.port;
    header.target = to.place.port;
    header.sequence = from.sequence;
    header.acknowledged = (flags & tcp_flag::ack) != 0 ? to.sequence : 0;
    header.flags = flags;
    Bytes body;
    if (syn) header.length = 0x70;
    wire::append(body, header, wire::Endian::big);
    if (syn)  // largest segment; window scale, preceded by a NOP byte
      for (const unsigned b :
           {2u, 4u, unsigned{most_segment >> 8}, unsigned{most_segment & 0xFF}, 1u, 3u, 3u, unsigned{window_scale}})
        body.push_back(static_cast<std::byte>(b));
    body.insert(body.end(), payload.begin(), payload.end());
    put_u16(body, 16, transport_checksum(ip_tcp, from.place, to.place, body));
    packet(packets, ip_tcp, from.place, to.place, body);
    const bool takes_a_number = (flags & (tcp_flag::syn | tcp_flag::fin)) != 0;
    from.sequence += static_cast<std::uint32_t>(payload.size()) + (takes_a_number ? 1u : 0u);
  }

  void datagram(Bytes& packets, const RecordedMessage& message) {
    const bool by_device = message.from == Origin::device;
    const IpEnd& from = by_device ? conversation_.status_from : conversation_.status_to;
    const IpEnd& to = by_device ? conversation_.status_to : conversation_.status_from;
    Bytes body;
    wire::Writer writer(body, wire::Endian::big);
    const auto size = static_cast<std::uint16_t>(8 + std::min<std::size_t>(message.bytes.size(), most_segment));
    for (const std::uint16_t value : {from.port, to.port, size, std::uint16_t{0}}) writer("u16", value);
    body.insert(body.end(), message.bytes.begin(), message.bytes.begin() + (size - 8));
    const std::uint16_t sum = transport_checksum(ip_udp, from, to, body);
    put_u16(body, 6, sum == 0 ? 0xFFFF : sum);  // 0 would mean that there is no checksum (RFC 768)
    packet(packets, ip_udp, from, to, body);
  }

  static std::uint16_t transport_checksum(std::uint8_t protocol, const IpEnd& from, const IpEnd& to, BytesView body) {
    Bytes pseudo;
    wire::Writer writer(pseudo, wire::Endian::big);
    writer("source", from.address);
    writer("target", to.address);
    return checksum_of(word_sum(body, word_sum(pseudo, protocol + body.size())));
  }

  void packet(Bytes& packets, std::uint8_t protocol, const IpEnd& from, const IpEnd& to, BytesView body) {
    IpHeader header;
    header.total_length = static_cast<std::uint16_t>(wire::wire_size<IpHeader>() + body.size());
    header.identification = identification_++;
    header.protocol = protocol;
    header.source = from.address;
    header.target = to.address;
    Bytes front = wire::bytes_of(header, wire::Endian::big);
    put_u16(front, 10, checksum_of(word_sum(front)));
    const auto since = last_.time_since_epoch();
    const auto whole = std::chrono::floor<std::chrono::seconds>(since);
    wire::Writer writer(packets);
    const auto u32 = [&writer](auto value) {
      const auto narrow = static_cast<std::uint32_t>(value);
      writer("u32", narrow);
    };
    u32(whole.count());
    u32((since - whole).count());
    u32(header.total_length);  // bytes in the file
    u32(header.total_length);  // bytes on the wire
    packets.insert(packets.end(), front.begin(), front.end());
    packets.insert(packets.end(), body.begin(), body.end());
  }

  std::unique_ptr<Sink> sink_;
  PcapConversation conversation_;
  End device_, client_;
  std::uint16_t identification_ = 0;
  bool begun_ = false, connected_ = false;
  Time last_{};
};

}  // namespace

// Datagrams are sent to the place where the make's hosts receive them: the beacon's port, the port of the dialogue, or the
// multicast group.
PcapConversation usual_ends(const protocol::Make& make, std::uint32_t device, std::uint32_t client) {
  using Kind = protocol::HostPort::Kind;
  PcapConversation ends;
  ends.device = {device, make.ports.front().number};
  ends.client.address = client;
  ends.status_from.address = device;
  if (const auto* const beacon = make.device->port(protocol::Port::Kind::udp_beacon))
    ends.status_from.port = ends.status_to.port = beacon->number;
  if (make.device->port(protocol::Port::Kind::udp_dialogue) != nullptr) {
    ends.status_from = ends.device;
    ends.status_to = ends.client;
  }
  for (const protocol::HostPort& port : make.ports) {
    if (port.kind != Kind::udp_listen) continue;
    const bool in_group = port.group != protocol::Ipv4{};
    ends.status_to.address = in_group ? text::number_from_ipv4(port.group) : client;
    ends.status_from.port = ends.status_to.port = port.number != 0 ? port.number : ends.client.port;
  }
  return ends;
}

std::unique_ptr<RecordingWriter> write_pcap(std::unique_ptr<Sink> sink, const PcapConversation& conversation) {
  return std::make_unique<PcapWriter>(std::move(sink), conversation);
}

}  // namespace sonar::recording
