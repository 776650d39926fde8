#include <algorithm>
#include <deque>
#include <map>
#include <set>

#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recording/pcap/packets.hpp"
#include "protocol/recording/pcap/pcap.hpp"
#include "protocol/sender.hpp"

namespace sonar::recording {
namespace {

constexpr std::size_t most_senders = 4096, most_connections = 64;
constexpr std::size_t most_held_bytes = 64u << 20;  // limit for all connections: early segments and messages under way

// ---- first pass: find the sonar

using protocol::Make;

struct SenderEnd {
  IpEnd at;
  bool tcp = true;
  auto operator<=>(const SenderEnd&) const = default;
};
struct Sent {
  std::uint64_t bytes = 0;
  const Make* make = nullptr;  // make of the messages that this end sends; null: it is not a sonar
};
struct Found {
  SenderEnd device;
  const Make* make = nullptr;
  std::string note;
};

/// Returns the make whose message is at the start of a segment; null if there is none. Clients may send such messages too. If
/// several makes match, returns the make whose usual port is that of the source, else the first.
const Make* make_of(const Segment& segment) {
  const Make* found = nullptr;
  if (!segment.tcp) {
    const auto by = sender_of({{}, Origin::device, Carrier::datagram, {segment.payload.begin(), segment.payload.end()}});
    return by && by->make->device->pings_by() != protocol::PingsBy::stream ? by->make : nullptr;
  }
  for (const Make& make : protocol::makes()) {
    const Framing* const framing = make.codec.framing;
    if (framing == nullptr || !framing->begins_message(segment.payload, Origin::device)) continue;
    const std::uint16_t usual = make.ports.front().number;
    if (framing->length == nullptr && usual != segment.source.port && usual != segment.target.port)
      continue;  // lines do not identify a make, because many programs send lines
    if (found == nullptr || usual == segment.source.port) found = &make;
  }
  return found;
}

/// Reads the whole capture once. An end that sends messages of a make counts as a sonar; an end at the make's usual port has
/// priority, then the end that sent most bytes. Tables are limited, because a capture of a port scan has thousands of ends.
Result<Found> find_device(Source& source, const PcapReading& reading) {
  auto packets = PacketReader::open(source);
  if (!packets) return tl::unexpected(packets.error());
  std::map<SenderEnd, Sent> senders;
  std::set<std::uint32_t> unknown_links;
  std::uint64_t fragmented = 0;
  while (const auto packet = packets->next()) {
    if (!is_known_link_type(packet->link_type) && unknown_links.size() < 16) unknown_links.insert(packet->link_type);
    if (begins_fragments(packet->link_type, packet->bytes)) ++fragmented;
    const auto segment = parse_packet(packet->link_type, packet->bytes);
    if (!segment || segment->payload.empty()) continue;
    const SenderEnd from{segment->source, segment->tcp};
    if (senders.size() >= most_senders && !senders.contains(from)) continue;
    Sent& sent = senders[from];
    sent.bytes += segment->payload.size();
    if (sent.make == nullptr) sent.make = make_of(*segment);
  }
  std::optional<SenderEnd> best;
  std::string others;
  const auto rank = [&](const SenderEnd& end) {
    const Sent& sent = senders.at(end);
    return std::pair(end.at.port == sent.make->ports.front().number, sent.bytes);
  };
  for (const auto& [end, sent] : senders)
    if (sent.make != nullptr && (!reading.device || *reading.device == end.at.address) && (!best || rank(end) > rank(*best)))
      best = end;
  if (!best) {
    std::string why = source.name() + " holds no pings of a sonar" + (reading.device ? " with that address" : "");
    for (const std::uint32_t type : unknown_links) why += "; packets of link type " + std::to_string(type) + " are not read";
    if (fragmented > 0) why += "; " + std::to_string(fragmented) + " datagrams are in IP fragments, which are not read";
    if (packets->damages().any()) why += "; " + packets->damages().first();
    return failure(ErrorKind::bad_data, why);
  }
  for (const auto& [end, sent] : senders)
    if (sent.make != nullptr && end.at.port == best->at.port && end != *best)
      others += (others.empty() ? "" : ", ") + text_of(end.at);
  return Found{*best, senders.at(*best).make, others.empty() ? "" : "the capture holds other sonars too: " + others};
}

// ---- second pass: messages of the sonar and its clients

/// A TCP connection of a client with the sonar. The segments of each direction are ordered (TcpStream), then split into messages.
struct Connection {
  explicit Connection(const Make& make)
      : device(Origin::device, *make.codec.framing), client(Origin::client, *make.codec.framing), junk(common_framing(make)) {}

  TcpStream device_stream, client_stream;
  MessageSplitter device, client;
  JunkReport junk;
  std::uint64_t last_packet = 0;

  std::size_t held_bytes() const {
    return device_stream.held_bytes() + client_stream.held_bytes() + device.waiting_bytes() + client.waiting_bytes();
  }
};

/// Returns the messages of the sonar that find_device() found. At the end of the capture the connections that are still open are
/// finished one by one.
class PcapReader final : public RecordingReader {
 public:
  PcapReader(std::unique_ptr<Source> source, PacketReader packets, Found found)
      : source_(std::move(source)), packets_(std::move(packets)), found_(std::move(found)) {}

  std::optional<RecordedMessage> next() override {
    while (ready_.empty()) {
      const auto packet = packets_.next();
      if (!packet) {
        if (connections_.empty()) break;
        finish(connections_.begin());
        continue;
      }
      ++packet_number_;
      if (const auto segment = parse_packet(packet->link_type, packet->bytes)) add(packet->at, *segment);
    }
    if (ready_.empty()) return std::nullopt;
    RecordedMessage message = std::move(ready_.front());
    ready_.pop_front();
    return message;
  }

  std::optional<Error> damage() const override {
    Damages all = damages_;
    all.add(packets_.damages());
    return all.error(source_->name());
  }
  std::string note() const override { return found_.note; }

  void rewind() override {
    packets_.rewind();
    packet_number_ = 0;
    connections_.clear();
    ready_.clear();
    damages_.clear();
  }

 private:
  using Place = std::map<IpEnd, Connection>::iterator;

  void add(Time at, const Segment& segment) {
    const IpEnd& device = found_.device.at;
    if (!segment.tcp) return add_datagram(at, segment);
    if (!found_.device.tcp) return;
    if (segment.source == device) add(at, segment, segment.target, Origin::device);
    if (segment.target == device) add(at, segment, segment.source, Origin::client);
  }

  /// Adds a datagram of a sonar that sends pings over UDP, or the status of a sonar that sends pings over TCP.
  void add_datagram(Time at, const Segment& segment) {
    const auto take = [&](Origin from) {
      ready_.push_back({at, from, Carrier::datagram, {segment.payload.begin(), segment.payload.end()}});
    };
    const bool from_device = segment.source.address == found_.device.at.address;
    if (!found_.device.tcp) {
      if (segment.target == found_.device.at)
        return take(Origin::client);  // tested first, because both ends may have the same address
      if (from_device) take(Origin::device);
      return;
    }
    const protocol::Port* const beacon = found_.make->device->port(protocol::Port::Kind::udp_beacon);
    if (from_device && beacon != nullptr && segment.target.port == beacon->number &&
        found_.make->codec.framing->begins_message(segment.payload, Origin::device))
      take(Origin::device);
  }

  /// Adds a segment to its connection. A SYN with another number on the same ports begins a new connection. A connection whose
  /// start is not in the capture begins with its first bytes.
  void add(Time at, const Segment& segment, const IpEnd& client, Origin from) {
    const bool syn = (segment.flags & tcp_flag::syn) != 0;
    Place place = connections_.find(client);
    if (place != connections_.end() && syn && stream_of(place->second, from).is_other(segment.sequence)) {
      finish(place);
      place = connections_.end();
    }
    if (place == connections_.end()) {
      if (!syn && segment.payload.empty()) return;
      if (connections_.size() >= most_connections) finish_oldest();
      place = connections_.try_emplace(client, *found_.make).first;
    }
    place->second.last_packet = packet_number_;
    stream_of(place->second, from).add(at, segment.sequence, segment.payload, syn);
    drain(place->second, client, from);
    if ((segment.flags & tcp_flag::rst) != 0) finish(place);
    // A capture with gaps in many connections must not take all memory.
    while (held_bytes() > most_held_bytes) finish_oldest();
  }

  std::size_t held_bytes() const {
    std::size_t bytes = 0;
    for (const auto& [client, connection] : connections_) bytes += connection.held_bytes();
    return bytes;
  }

  void finish_oldest() {
    Place oldest = connections_.begin();
    for (Place each = oldest; each != connections_.end(); ++each)
      if (each->second.last_packet < oldest->second.last_packet) oldest = each;
    finish(oldest);
  }

  /// Ends a connection: returns the complete messages, and notes the incomplete ones.
  void finish(Place place) {
    for (const Origin from : {Origin::device, Origin::client}) {
      stream_of(place->second, from).finish();
      drain(place->second, place->first, from);
      MessageSplitter& splitter = from == Origin::device ? place->second.device : place->second.client;
      const std::uint64_t losses = splitter.losses();
      splitter.finish();
      take_messages(place->second, place->first, from);
      place->second.junk.end(damages_);
      if (splitter.losses() > losses)
        damages_.add("the last message from " + text_of(from == Origin::device ? found_.device.at : place->first) + " to " +
                     text_of(from == Origin::device ? place->first : found_.device.at) + " is incomplete");
    }
    connections_.erase(place);
  }

  static TcpStream& stream_of(Connection& connection, Origin from) {
    return from == Origin::device ? connection.device_stream : connection.client_stream;
  }

  void take_messages(Connection& connection, const IpEnd& client, Origin from) {
    while (auto message = (from == Origin::device ? connection.device : connection.client).next()) {
      if (from == Origin::device)
        connection.junk.take(
            message->bytes,
            [&] { return "packet " + std::to_string(packet_number_) + " of the connection with " + text_of(client); }, damages_);
      ready_.push_back(std::move(*message));
    }
  }

  void drain(Connection& connection, const IpEnd& client, Origin from) {
    MessageSplitter& splitter = from == Origin::device ? connection.device : connection.client;
    while (const auto run = stream_of(connection, from).next()) {
      const std::uint64_t lost = splitter.lost_bytes();
      // After a gap, or at the start of a capture, the bytes may be in the middle of a message.
      if (run->missing_before > 0 || run->from_middle) splitter.break_off();
      splitter.append(run->at, run->bytes);
      take_messages(connection, client, from);
      if (run->missing_before > 0)
        damages_.add("before packet " + std::to_string(packet_number_) + " the capture lacks " +
                     std::to_string(run->missing_before) + " bytes of the connection with " + text_of(client));
      else if (run->from_middle && splitter.lost_bytes() > lost)
        damages_.add("the capture begins within a message of the connection with " + text_of(client));
    }
  }

  std::unique_ptr<Source> source_;
  PacketReader packets_;
  Found found_;
  std::uint64_t packet_number_ = 0;  // counted from 1, as in Wireshark
  std::map<IpEnd, Connection> connections_;
  std::deque<RecordedMessage> ready_;
  Damages damages_;
};

}  // namespace

Result<std::unique_ptr<RecordingReader>> read_pcap(std::unique_ptr<Source> source, const PcapReading& reading) {
  auto found = find_device(*source, reading);
  if (!found) return tl::unexpected(found.error());
  auto packets = PacketReader::open(*source);
  if (!packets) return tl::unexpected(packets.error());
  return std::make_unique<PcapReader>(std::move(source), std::move(*packets), std::move(*found));
}

}  // namespace sonar::recording
