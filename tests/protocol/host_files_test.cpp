// Tests for each make that its host reads the same pings from the device's bytes in files of every kind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

#include "core/text/ipv4.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"
#include "protocol/recording/recording.hpp"
#include "tests/protocol/hosts_testing.hpp"

namespace sonar::protocol::hosts_test {
namespace {

/// Returns the messages that the device sent, as in a recording.
std::vector<recording::RecordedMessage> messages_of(const Talk& talk) {
  std::vector<recording::RecordedMessage> messages;
  for (const auto& [port, bytes] : talk.sent) {
    const bool by_tcp = talk.make.ports[port].kind == HostPort::Kind::tcp;
    messages.push_back({Time(1'700'000'000s) + messages.size() * 10ms, recording::Origin::device,
                        by_tcp ? recording::Carrier::stream : recording::Carrier::datagram, bytes});
  }
  return messages;
}

std::vector<std::vector<float>> samples_of(const std::vector<HostPing>& pings) {
  std::vector<std::vector<float>> all;
  for (const HostPing& ping : pings) all.push_back(ping.picture().value_or(PolarImage{}).samples);
  return all;
}

std::vector<HostPing> read_back(const Make& make, Bytes file) {
  auto opened = recording::open_recording(recording::source_from("a file", std::move(file)));
  if (!opened) throw std::runtime_error(opened.error().text);
  const auto by = recording::find_sender(*opened->reader);
  EXPECT_EQ(by ? by->make->name() : "no make", make.name());
  Wanted nothing;
  nothing.as_it_is = true;
  const auto host = *make.host(nothing);
  std::vector<HostPing> pings;
  while (const auto message = opened->reader->next())
    if (const auto port = recording::host_port(make, message->by))
      for (HostAction& action : host->on_bytes(*port, message->bytes, message->at))
        if (auto* ping = std::get_if<HostPing>(&action)) pings.push_back(std::move(*ping));
  EXPECT_FALSE(opened->reader->damage()) << opened->reader->damage()->text;
  return pings;
}

TEST_P(Hosts, ReadTheSamePingsFromEveryKindOfFile) {
  const Make& make = GetParam();
  Talk talk(make, all_that_is_known(make, range_m), 0, model_of(make));
  talk.run(6);
  ASSERT_FALSE(talk.pings.empty());
  const bool by_tcp = make.device->pings_by() != PingsBy::datagrams;
  const recording::PcapConversation ends = recording::usual_ends(make);
  std::map<std::string, std::function<std::unique_ptr<recording::RecordingWriter>(std::unique_ptr<recording::Sink>)>> kinds;
  kinds["mcap"] = [&](auto sink) { return std::make_unique<recording::McapSession>(std::move(sink), "front", make); };
  kinds["pcap"] = [&](auto sink) { return recording::write_pcap(std::move(sink), ends); };
  if (make.codec.framing != nullptr && by_tcp && test::conversations_of(make).size() < 2)
    kinds["raw"] = [](auto sink) { return recording::write_raw_dump(std::move(sink)); };
  for (const recording::FileKind& kind : make.codec.files) kinds[std::string(kind.ending)] = kind.write;
  for (const auto& [name, write] : kinds) {
    SCOPED_TRACE(name);
    Bytes file;
    const auto writer = write(recording::sink_into(file));
    for (const recording::RecordedMessage& message : messages_of(talk)) ASSERT_TRUE(writer->write(message));
    ASSERT_TRUE(writer->close());
    EXPECT_EQ(samples_of(read_back(make, file)), samples_of(talk.pings));
  }
}

TEST_P(Hosts, HavePortsOfTheirMakeInACapture) {
  const Make& make = GetParam();
  const bool by_tcp = make.ports.front().kind == HostPort::Kind::tcp;
  const recording::PcapConversation ends = recording::usual_ends(make, 0x0A000001, 0x0A000002);
  EXPECT_EQ(ends.device, (recording::IpEnd{0x0A000001, make.ports.front().number}));
  EXPECT_EQ(ends.client.address, 0x0A000002u);
  EXPECT_EQ(ends.status_from.address, 0x0A000001u);
  if (make.ports.front().kind == HostPort::Kind::udp) {
    EXPECT_EQ(ends.status_from, ends.device);
    EXPECT_EQ(ends.status_to, ends.client);
  }
  for (const HostPort& port : make.ports)
    if (port.group != Ipv4{}) {
      EXPECT_EQ(ends.status_to, (recording::IpEnd{text::number_from_ipv4(port.group), port.number}));
    }
  const Port* const beacon = make.device->port(Port::Kind::udp_beacon);
  if (by_tcp && make.ports.size() == 1 && beacon != nullptr) {
    EXPECT_EQ(ends.status_to.port, beacon->number);
  }
}

}  // namespace
}  // namespace sonar::protocol::hosts_test
