// Tests captures as other programs write them: every link type; lost, repeated and reordered segments; both byte orders;
// pcapng.
#include "protocol/ping/messages.hpp"
#include "protocol/recording/pcap/packets.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::tests {
namespace {

using ::testing::HasSubstr;

// ---- captures that are made by hand

Bytes numbers(wire::Endian endian, std::initializer_list<std::pair<unsigned, std::uint32_t>> sizes_and_values) {
  Bytes bytes;
  wire::Writer writer(bytes, endian);
  for (const auto& [size, value] : sizes_and_values) {
    const std::uint32_t u32 = value;
    const auto u16 = static_cast<std::uint16_t>(value);
    const auto u8 = static_cast<std::uint8_t>(value);
    if (size == 4) writer("u32", u32);
    if (size == 2) writer("u16", u16);
    if (size == 1) writer("u8", u8);
  }
  return bytes;
}
Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Sent {
  Bytes payload;
  std::uint32_t sequence = 0;
  bool from_device = true;
  std::uint8_t flags = tcp_flag::ack;
  std::uint16_t device_port = 52100;
};
constexpr std::uint32_t device_ip = 0x0A000001, client_ip = 0x0A000002;

Bytes ip_packet(const Sent& s) {
  const auto big = wire::Endian::big;
  const std::uint16_t from = s.from_device ? s.device_port : 40000, to = s.from_device ? 40000 : s.device_port;
  const Bytes tcp = numbers(big, {{2, from}, {2, to}, {4, s.sequence}, {4, 0}, {1, 0x50}, {1, s.flags}, {2, 500}, {4, 0}});
  const auto total = static_cast<std::uint32_t>(40 + s.payload.size());
  return numbers(big, {{2, 0x4500},
                       {2, total},
                       {4, 0},
                       {2, 0x4006},
                       {2, 0},
                       {4, s.from_device ? device_ip : client_ip},
                       {4, s.from_device ? client_ip : device_ip}}) +
         tcp + s.payload;
}

Bytes pcap_of(const std::vector<Bytes>& frames, std::uint32_t link_type, wire::Endian endian = wire::Endian::little,
              std::uint32_t magic = 0xA1B2C3D4) {
  Bytes file = numbers(endian, {{4, magic}, {2, 2}, {2, 4}, {4, 0}, {4, 0}, {4, 65535}, {4, link_type}});
  std::uint32_t number = 0;
  for (const Bytes& frame : frames) {
    const auto size = static_cast<std::uint32_t>(frame.size());
    file = file + numbers(endian, {{4, 1000}, {4, 100 * number++}, {4, size}, {4, size}}) + frame;
  }
  return file;
}

/// Returns a message in segments of 100 bytes, and another in one segment.
std::vector<Sent> two_pings(std::uint32_t first = 1) {
  std::vector<Sent> sent;
  const Bytes ping = ping_message(1);
  for (std::size_t at = 0; at < ping.size(); at += 100) {
    const auto part = BytesView(ping).subspan(at, std::min<std::size_t>(100, ping.size() - at));
    sent.push_back({{part.begin(), part.end()}, first + static_cast<std::uint32_t>(at)});
  }
  sent.push_back({ping_message(2), first + static_cast<std::uint32_t>(ping.size())});
  return sent;
}

std::vector<Bytes> raw_frames(const std::vector<Sent>& sent) {
  std::vector<Bytes> frames;
  for (const Sent& each : sent) frames.push_back(ip_packet(each));
  return frames;
}

struct ReadBack {
  Bytes stream;
  std::string damage;
};
ReadBack read(const Bytes& file) {
  auto opened = open_bytes(file);
  if (!opened) return {{}, opened.error().text};
  const Bytes stream = device_stream(read_all(*opened->reader));
  const auto damage = opened->reader->damage();
  return {stream, damage ? damage->text : ""};
}
const Bytes both_pings = ping_message(1) + ping_message(2);

// ---- tests

TEST(CaptureFiles, EveryLinkTypeIsRead) {
  const auto big = wire::Endian::big;
  const Bytes mac = numbers(big, {{4, 1}, {4, 2}, {4, 3}});
  const std::vector<std::pair<std::uint32_t, Bytes>> links{
      {1, mac + numbers(big, {{2, 0x0800}})},
      {1, mac + numbers(big, {{2, 0x8100}, {2, 5}, {2, 0x0800}})},
      {0, numbers(wire::Endian::little, {{4, 2}})},
      {0, numbers(big, {{4, 2}})},
      {101, {}},
      {12, {}},
      {228, {}},
      {113, numbers(big, {{4, 0}, {4, 0}, {4, 0}, {2, 0}, {2, 0x0800}})},
      {276, numbers(big, {{2, 0x0800}, {2, 0}, {4, 0}, {4, 0}, {4, 0}, {4, 0}})},
  };
  for (const auto& [type, front] : links) {
    std::vector<Bytes> frames;
    for (const Bytes& packet : raw_frames(two_pings())) frames.push_back(front + packet);
    const ReadBack result = read(pcap_of(frames, type));
    EXPECT_EQ(result.stream, both_pings) << type;
    EXPECT_EQ(result.damage, "");
  }
  EXPECT_THAT(read(pcap_of(raw_frames(two_pings()), 147)).damage, HasSubstr("packets of link type 147 are not read"));
}

TEST(CaptureFiles, BothByteOrdersAndTimeUnitsAreRead) {
  for (const auto endian : {wire::Endian::little, wire::Endian::big})
    for (const std::uint32_t magic : {0xA1B2C3D4u, 0xA1B23C4Du}) {
      auto opened = open_bytes(pcap_of(raw_frames(two_pings()), 101, endian, magic));
      ASSERT_TRUE(opened);
      const std::vector<RecordedMessage> messages = read_all(*opened->reader);
      ASSERT_EQ(messages.size(), 2u);
      const auto last = static_cast<std::int64_t>(100 * (two_pings().size() - 1) * (magic == 0xA1B2C3D4u ? 1000 : 1));
      EXPECT_EQ(messages[1].at, Time(std::chrono::seconds(1000) + std::chrono::nanoseconds(last)));
    }
}

TEST(CaptureFiles, RetransmittedAndReorderedSegmentsAreRead) {
  std::vector<Sent> sent = two_pings();
  std::swap(sent[2], sent[4]);
  std::swap(sent[8], sent[9]);
  sent.insert(sent.begin() + 6, sent[1]);
  sent.insert(sent.begin() + 7, sent[5]);
  Sent longer = sent[0];  // begins before the known bytes and ends after them
  longer.payload = longer.payload + two_pings()[1].payload;
  sent.insert(sent.begin() + 1, longer);
  const ReadBack result = read(pcap_of(raw_frames(sent), 101));
  EXPECT_EQ(result.stream, both_pings);
  EXPECT_EQ(result.damage, "");
}

TEST(CaptureFiles, SequenceNumbersWrap) { EXPECT_EQ(read(pcap_of(raw_frames(two_pings(0xFFFFFF00u)), 101)).stream, both_pings); }

TEST(CaptureFiles, ALostSegmentLosesOnlyItsMessage) {
  std::vector<Sent> sent = two_pings();
  sent.erase(sent.begin() + 3);
  const ReadBack result = read(pcap_of(raw_frames(sent), 101));
  EXPECT_EQ(result.stream, ping_message(2));
  EXPECT_THAT(result.damage, HasSubstr("the capture lacks 100 bytes of the connection with 10.0.0.2:40000"));
}

TEST(CaptureFiles, SegmentsCutByTheSnapLengthAreLost) {
  std::vector<Bytes> frames = raw_frames(two_pings());
  frames[1].resize(60);
  const ReadBack result = read(pcap_of(frames, 101));
  EXPECT_EQ(result.stream, ping_message(2));
  EXPECT_THAT(result.damage, HasSubstr("the capture lacks 80 bytes"));
}

TEST(CaptureFiles, ACaptureMayBeginInTheMiddle) {
  std::vector<Sent> sent = two_pings();
  sent.erase(sent.begin(), sent.begin() + 2);
  const std::vector<Bytes> frames = raw_frames(sent);
  // The sonar is found although its first packet is not the start of a message.
  const ReadBack result = read(pcap_of(frames, 101));
  EXPECT_EQ(result.stream, ping_message(2));
  EXPECT_THAT(result.damage, HasSubstr("begins within a message"));
}

TEST(CaptureFiles, ConnectionsMayFollowEachOther) {
  std::vector<Sent> sent{{{}, 99, true, tcp_flag::syn | tcp_flag::ack}};
  for (const Sent& each : two_pings(100)) sent.push_back(each);
  sent.push_back({{}, 5000, true, tcp_flag::syn | tcp_flag::ack});  // a new connection with the same ports
  sent.push_back({ping_message(3), 5001});
  sent.push_back({{}, 5001 + static_cast<std::uint32_t>(ping_message(3).size()), true, tcp_flag::fin | tcp_flag::ack});
  const ReadBack result = read(pcap_of(raw_frames(sent), 101));
  EXPECT_EQ(result.stream, both_pings + ping_message(3));
  EXPECT_EQ(result.damage, "");
}

TEST(CaptureFiles, TheSonarIsRecognisedByItsPortOrItsMessages) {
  std::vector<Sent> other = two_pings();
  for (Sent& each : other) each.device_port = 6000;
  EXPECT_EQ(read(pcap_of(raw_frames(other), 101)).stream, both_pings);
  std::vector<Sent> web{{bytes_of("GET / HTTP/1.0"), 1}};
  web[0].device_port = 80;
  EXPECT_THAT(read(pcap_of(raw_frames(web), 101)).damage, HasSubstr("holds no pings of a sonar"));
  for (const Sent& each : two_pings()) web.push_back(each);
  EXPECT_EQ(read(pcap_of(raw_frames(web), 101)).stream, both_pings);
}

TEST(CaptureFiles, OneOfSeveralSonarsCanBeSelected) {
  std::vector<Bytes> frames = raw_frames(two_pings());
  Bytes second = ip_packet({dummy_message(), 1});
  second[15] = std::byte{9};  // 10.0.0.9
  frames.push_back(second);
  auto most = open_bytes(pcap_of(frames, 101)), named = open_bytes(pcap_of(frames, 101), "10.0.0.9");
  ASSERT_TRUE(most && named);
  EXPECT_EQ(device_stream(read_all(*most->reader)), both_pings);
  EXPECT_EQ(most->reader->note(), "the capture holds other sonars too: 10.0.0.9:52100");
  EXPECT_EQ(device_stream(read_all(*named->reader)), dummy_message());
  EXPECT_THAT(open_bytes(pcap_of(frames, 101), "10.0.0.10").error().text, HasSubstr("with that address"));
  EXPECT_EQ(open_bytes(pcap_of(frames, 101), "10.0.0").error().kind, ErrorKind::usage);
  EXPECT_EQ(open_bytes(pcap_of(frames, 101), "10.0.0.1x").error().kind, ErrorKind::usage);
}

constexpr std::uint16_t host_port_number = 40000;
Bytes udp_packet(const Bytes& payload, std::uint16_t from, std::uint16_t to, std::uint32_t fragment = 0) {
  const auto size = static_cast<std::uint32_t>(8 + payload.size());
  return numbers(wire::Endian::big, {{2, 0x4500},
                                     {2, 20 + size},
                                     {2, 0},
                                     {2, fragment},
                                     {2, 0x4011},
                                     {2, 0},
                                     {4, device_ip},
                                     {4, device_ip},
                                     {2, from},
                                     {2, to},
                                     {2, size},
                                     {2, 0}}) +
         payload;
}

TEST(CaptureFiles, BothEndsOfDatagramsAtOneAddressAreDistinguished) {
  const std::pair<std::uint16_t, ping::Id> sonars[] = {
      {12345, ping::Id::device_data}, {62312, ping::Id::yz_point_data}, {51200, ping::Id::os_mono_profile}};
  for (const auto& [port, id] : sonars) {
    const Bytes request = ping::framed(ping::Id::general_request, 0, Bytes(2)), pinged = ping::framed(id, 1, Bytes(60));
    auto opened = open_bytes(pcap_of({udp_packet(request, host_port_number, port), udp_packet(pinged, port, host_port_number),
                                      udp_packet(request, host_port_number, port)},
                                     101));
    ASSERT_TRUE(opened) << port << ": " << opened.error().text;
    std::vector<std::pair<Origin, Bytes>> found;
    for (const RecordedMessage& message : read_all(*opened->reader)) found.emplace_back(message.from, message.bytes);
    const std::vector<std::pair<Origin, Bytes>> sent{
        {Origin::client, request}, {Origin::device, pinged}, {Origin::client, request}};
    EXPECT_EQ(found, sent) << port;
    opened->reader->rewind();
    const auto by = find_sender(*opened->reader);
    ASSERT_TRUE(by);
    EXPECT_EQ(host_port(*by->make, Carrier::datagram), 0u) << port;
  }
}

TEST(CaptureFiles, DatagramsInFragmentsAreCounted) {
  const Bytes half(600);
  const std::uint32_t more = 0x2000, second_part = 75;
  const std::vector<Bytes> frames{udp_packet(half, 12345, host_port_number, more),
                                  udp_packet(half, 12345, host_port_number, second_part),
                                  udp_packet(half, 12345, host_port_number, more)};
  EXPECT_THAT(read(pcap_of(frames, 101)).damage, HasSubstr("; 2 datagrams are in IP fragments, which are not read"));
}

TEST(CaptureFiles, ErrorsHaveTheOffset) {
  Bytes huge = pcap_of(raw_frames(two_pings()), 101);
  const std::size_t last = huge.size() - ping_message(2).size() - 40 - 8;
  huge[last + 3] = std::byte{0x7F};
  const ReadBack result = read(huge);
  EXPECT_EQ(result.stream, ping_message(1));
  EXPECT_THAT(result.damage, HasSubstr("the packet at byte " + std::to_string(last - 8) + " would have "));
}

TEST(CaptureFiles, ZerosAreNoPackets) {
  Bytes file = pcap_of(raw_frames(two_pings()), 101);
  const std::size_t whole = file.size();
  file.resize(whole + 100);
  const ReadBack result = read(file);
  EXPECT_EQ(result.stream, both_pings);
  EXPECT_THAT(result.damage, HasSubstr("the packet at byte " + std::to_string(whole) + " has a length of 0 bytes on the wire"));
}

Bytes block(std::uint32_t type, Bytes body) {
  while (body.size() % 4 != 0) body.push_back(std::byte{0});
  const auto size = static_cast<std::uint32_t>(body.size() + 12);
  return numbers(wire::Endian::little, {{4, type}, {4, size}}) + body + numbers(wire::Endian::little, {{4, size}});
}

TEST(CaptureFiles, PcapngIsRead) {
  const auto little = wire::Endian::little;
  Bytes file = block(0x0A0D0D0A, numbers(little, {{4, 0x1A2B3C4D}, {2, 1}, {2, 0}, {4, 0xFFFFFFFF}, {4, 0xFFFFFFFF}}));
  file = file + block(1, numbers(little, {{2, 1}, {2, 0}, {4, 0}}));                                    // Ethernet, unused
  file = file + block(1, numbers(little, {{2, 101}, {2, 0}, {4, 0}, {2, 9}, {2, 1}, {4, 9}, {4, 0}}));  // nanoseconds
  file = file + block(5, bytes_of("statistics, passed over"));
  const std::uint64_t at_ns = 1'700'000'000'000'000'123;
  for (const Bytes& packet : raw_frames(two_pings())) {
    const auto size = static_cast<std::uint32_t>(packet.size());
    file = file + block(6, numbers(little, {{4, 1},
                                            {4, static_cast<std::uint32_t>(at_ns >> 32)},
                                            {4, static_cast<std::uint32_t>(at_ns)},
                                            {4, size},
                                            {4, size}}) +
                               packet);
  }
  auto opened = open_bytes(file);
  ASSERT_TRUE(opened) << opened.error().text;
  const std::vector<RecordedMessage> messages = read_all(*opened->reader);
  EXPECT_EQ(device_stream(messages), both_pings);
  ASSERT_FALSE(messages.empty());
  EXPECT_EQ(messages[0].at, Time(std::chrono::nanoseconds(at_ns)));
  EXPECT_FALSE(opened->reader->damage());
  Bytes damaged = file;  // the first packet names a missing interface
  const Bytes first = numbers(little, {{4, 1}, {4, static_cast<std::uint32_t>(at_ns >> 32)}});
  const auto place = std::search(damaged.begin(), damaged.end(), first.begin(), first.end());
  ASSERT_NE(place, damaged.end());
  *place = std::byte{9};
  const ReadBack result = read(damaged);
  EXPECT_EQ(result.stream, ping_message(2)) << "only the message of the damaged packet is lost";
  EXPECT_THAT(result.damage, HasSubstr("begins within a message"));
  EXPECT_THAT(result.damage, HasSubstr("; 1 more such place"));
  for (std::size_t size = 12; size < file.size(); size += 7)
    static_cast<void>(read({file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)}));
}

TEST(CaptureFiles, ConnectionsShareTheLimitOfWaitingBytes) {
  constexpr std::size_t early_bytes = 65'000;
  std::vector<Bytes> frames;
  const auto add = [&frames](std::uint8_t client, const Sent& sent) {
    frames.push_back(ip_packet(sent));
    frames.back()[23] = std::byte{client};  // low byte of the client's port
  };
  for (std::uint8_t client = 0; client < 20; ++client) {  // 78 MB in all; each connection waits for 500 bytes
    add(client, {dummy_message(), 1});
    for (std::uint32_t i = 0; i < 60; ++i) add(client, {Bytes(early_bytes), 517 + i * static_cast<std::uint32_t>(early_bytes)});
  }
  Bytes file = pcap_of({}, 101);
  file.reserve(frames.size() * (early_bytes + 100));
  for (const Bytes& frame : frames) {
    const auto size = static_cast<std::uint32_t>(frame.size());
    for (const Bytes& part : {numbers(wire::Endian::little, {{4, 1000}, {4, 0}, {4, size}, {4, size}}), frame})
      file.insert(file.end(), part.begin(), part.end());
  }
  const std::string result = read(file).damage;
  const std::string before = "before packet ";
  const std::size_t at = result.find(before);
  ASSERT_NE(at, std::string::npos) << result;
  const std::size_t packet = std::stoul(result.substr(at + before.size()));
  EXPECT_GT(packet, 900u) << result;
  EXPECT_LT(packet, 1100u) << "the first connection is given up long before the end: " << result;
  EXPECT_THAT(result, HasSubstr("; 19 more such places"));
}

TEST(TcpStream, BytesThatWaitTooLongAreReturnedWithTheirGap) {
  TcpStream stream;
  const Bytes block_of(1 << 16, std::byte{1});
  stream.add(start, 0, {}, true);
  stream.add(start, 1, block_of, false);
  std::uint32_t sequence = 1 + (2u << 16);  // a hole of 64 KB
  for (int i = 0; i < 200; ++i, sequence += 1u << 16) stream.add(start, sequence, block_of, false);
  std::uint64_t runs = 0, missing = 0;
  while (const auto run = stream.next()) {
    ++runs;
    missing += run->missing_before;
  }
  EXPECT_EQ(runs, 201u);
  EXPECT_EQ(missing, 65536u);
}

TEST(WrittenCaptures, HaveSegmentsAndSequenceNumbers) {
  Bytes file;
  PcapConversation conversation_of;
  conversation_of.first_device_sequence = 0xFFFFF000u;  // wraps within the first message
  const auto writer = write_pcap(sink_into(file), conversation_of);
  const Bytes ping = ping_message(1, 512, 300);
  ASSERT_TRUE(writer->write({start, Origin::device, Carrier::stream, ping}));
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(read(file).stream, ping);
  EXPECT_EQ(read(file).damage, "");
  const auto source = source_from("a file", file);
  auto packets = PacketReader::open(*source);
  ASSERT_TRUE(packets);
  std::size_t longest = 0, count = 0;
  while (const auto packet = packets->next()) {
    ++count;
    longest = std::max(longest, packet->bytes.size());
    EXPECT_EQ(packet->at, start);
    ASSERT_TRUE(parse_packet(packet->link_type, packet->bytes));
  }
  EXPECT_EQ(longest, 65535u);
  EXPECT_EQ(count, 3 + (ping.size() + 65494) / 65495 + 1 + 3);
}

}  // namespace
}  // namespace sonar::recording::tests
