// The host of each make against the device of the same make, in memory and virtual time: settings have their effect, and pings
// arrive for any split of the bytes. Cut or foreign bytes cause neither a ping nor a crash.
#include "protocol/host.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <map>
#include <random>

#include "core/image/draw_picture.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/recorded/raw_dump.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"
#include "protocol/recording/recording.hpp"
#include "tests/is_sanitized.hpp"
#include "tests/protocol/stream_ports.hpp"

namespace sonar::protocol::hosts_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// True if hosts of this make set nothing; `sonarctl set sonar` does it.
bool sets_nothing(const Make& make) {
  Wanted range;
  range.settings.range_m = 3;
  return !make.host(range);
}

Wanted all_that_is_known(const Make& make, double range_m) {
  Wanted wanted;
  wanted.settings.range_m = range_m;
  if (sets_nothing(make)) {
    wanted.settings.rate_hz = 5;
    wanted.settings.gain_percent = 50;
    return wanted;
  }
  for (auto SettingsOverride::*setting : {&SettingsOverride::rate_hz, &SettingsOverride::gain_percent}) {
    Wanted more = wanted;
    more.settings.*setting = setting == &SettingsOverride::rate_hz ? 5 : 50;
    if (make.host(more)) wanted = more;
  }
  wanted.settings.mode = 0;
  return wanted;
}

/// Each byte is 7 more than the one before, modulo 251; copied in blocks, because single bytes take long without optimisation.
void fill_with_pattern(std::vector<std::byte>& samples) {
  std::array<std::byte, 251> period;
  for (std::size_t i = 0; i < period.size(); ++i) period[i] = static_cast<std::byte>(i * 7 % period.size());
  for (std::size_t at = 0; at < samples.size(); at += period.size())
    std::copy_n(period.begin(), std::min(period.size(), samples.size() - at), samples.begin() + static_cast<std::ptrdiff_t>(at));
}

class Talk {
 public:
  /// Streams arrive in pieces of this many bytes; 0: in the pieces that were written.
  Talk(const Make& of, const Wanted& wanted, std::size_t piece = 0, std::size_t model = 0)
      : make(of), device(*of.device), piece_(piece), host(*of.host(sets_nothing(of) ? Wanted{} : wanted)) {
    state.name = "front";
    state.id = 7001;
    state.model = device.models()[model];
    state.water = {12, 30, 8.0, 0};
    state.options = *check_options(device, {});
    const ChangeSettings first = device.initial_settings(state);
    state.settings = first.vendor_settings;
    settings = first.settings;
    if (sets_nothing(of)) apply({*device.apply_override(wanted.settings, state)});
    for (const auto& [at, port] : test::conversations_of(make)) lines_.push_back({at, port, device.converse(*port, state, now)});
    const std::vector<std::uint16_t> own(make.ports.size(), 40000);
    carry_out(host->on_open(own, now));
  }

  /// Steps of a tenth of a second, with a ping in each unless the device pings on request.
  void run(int steps) {
    for (int i = 0; i < steps && !error; ++i) {
      now += 100ms;
      for (Line& line : lines_)
        while (line.dialogue->next_tick() <= now) react(line, line.dialogue->on_tick(now, false));
      carry_out(host->on_tick(now));
      carry_out(host->on_demand(now));
      const bool by_request = make.each_ping_requested || make.scans;
      if (!by_request && settings.rate_hz > 0 && host->is_open()) ping();
      while (requested_ > 0) --requested_, ping();
    }
  }

  void carry_out(HostActions actions) {
    for (HostAction& action : actions) {
      if (const auto* send = std::get_if<HostSend>(&action)) {
        const auto line = std::ranges::find(lines_, send->port, &Line::host_port);
        ASSERT_NE(line, lines_.end()) << "bytes for a port without a conversation";
        in_pieces(send->port, send->bytes, [&](BytesView part) { react(*line, line->dialogue->on_bytes(part, now)); });
      } else if (const auto* ask = std::get_if<ResourceRequest>(&action)) {
        const ResourceReply reply = device.on_http(*device.port(Port::Kind::http), *ask, state, now);
        apply(reply.events);
        carry_out(host->on_reply(reply, now));
      } else if (auto* ping = std::get_if<HostPing>(&action)) {
        pings.push_back(std::move(*ping));
      } else if (auto* failed = std::get_if<Error>(&action)) {
        error = *failed;
      }
    }
  }

  const Make& make;
  const Vendor& device;
  std::size_t piece_;
  std::unique_ptr<Host> host;
  DeviceState state;
  PingSettings settings;
  Time now = Time(1'700'000'000s);
  std::vector<HostPing> pings;
  std::vector<std::pair<std::size_t, Bytes>> sent;  // by the device, with the host's port
  std::optional<Error> error;
  bool only_port = false;  // echoes are in some rows of the outermost quarter of the beams to port
  double head_rad = 0;     // head angle of the request before

 private:
  struct Line {
    std::size_t host_port;
    const Port* port;
    std::unique_ptr<Dialogue> dialogue;
  };
  void react(const Line& line, const Reaction& reaction) {
    for (const Bytes& reply : reaction.replies) deliver(line.host_port, reply);
    apply(reaction.events);
  }
  void apply(const std::vector<Event>& events) {
    for (const Event& event : events) {
      if (const auto* change = std::get_if<ChangeSettings>(&event)) {
        state.settings = change->vendor_settings;
        settings = change->settings;
      }
      if (const auto* request = std::get_if<RequestPing>(&event)) {
        ++requested_;
        with_ = request->with;
        head_rad = request->head_rad;
      }
      if (const auto* close = std::get_if<Close>(&event)) error = Error{ErrorKind::io, close->why};
    }
  }

  void deliver(std::size_t port, const Bytes& bytes) {
    sent.emplace_back(port, bytes);
    in_pieces(port, bytes, [&](BytesView part) { carry_out(host->on_bytes(port, part, now)); });
  }
  /// Passes streams on in pieces and datagrams whole.
  void in_pieces(std::size_t port, const Bytes& bytes, const std::function<void(BytesView)>& give) const {
    const std::size_t step = piece_ == 0 || make.ports[port].kind != HostPort::Kind::tcp ? bytes.size() : piece_;
    for (std::size_t at = 0; at < bytes.size(); at += step) give(BytesView(bytes).subspan(at, std::min(step, bytes.size() - at)));
  }

  void ping() {
    Ping made;
    PingRequest& request = made.request;
    request.model = state.model;
    request.number = PingNumber{++state.last_ping};
    request.fired_at = now;
    request.settings = settings;
    request.vendor_settings = with_ ? with_ : state.settings;
    request.water = state.water;
    const auto beams = static_cast<std::size_t>(settings.beam_count), rows = static_cast<std::size_t>(settings.range_bin_count);
    for (std::size_t i = 0; i < beams; ++i)
      made.beam_azimuth_rad.push_back(beams < 2 ? 0.0f : 0.5f - static_cast<float>(i) / static_cast<float>(beams - 1));
    const std::size_t sample_bytes = static_cast<std::size_t>(std::max(settings.format.bits / 8, 1));
    made.samples.resize(beams * rows * sample_bytes);
    if (!only_port) fill_with_pattern(made.samples);
    for (std::size_t row = 8; only_port && row < rows; row += 16)
      std::fill_n(made.samples.begin() + static_cast<std::ptrdiff_t>(row * beams * sample_bytes), beams / 4 * sample_bytes,
                  std::byte{100});
    const Port* const stream = device.port(Port::Kind::udp_stream);
    bool by_stream = false;
    Ping looked_at = made;
    look_at(looked_at);
    for (Line& line : lines_) {
      const auto framed = test::bytes_at(make, *line.port, made, state);
      const auto framed_later = test::bytes_at(make, *line.port, looked_at, state);
      EXPECT_EQ(framed_later ? *framed_later : Bytes{}, framed ? *framed : Bytes{}) << "the findings are the same";
      by_stream = by_stream || (framed && line.port->kind == Port::Kind::tcp_stream);
      const auto delivery = line.dialogue->on_ping(request.vendor_settings.get(), framed ? framed->size() : 0, now);
      for (const Bytes& prefix : delivery.prefixes) {
        if (!framed) continue;
        Bytes whole = prefix;
        whole.insert(whole.end(), framed->begin(), framed->end());
        deliver(line.host_port, whole);
      }
      apply(delivery.events);
    }
    if (by_stream) return;
    const std::size_t to = make.ports.size() - 1;
    for (const Bytes& datagram : device.datagrams(stream != nullptr ? *stream : *lines_.front().port, made, state))
      deliver(to, datagram);
  }

  std::vector<Line> lines_;
  std::shared_ptr<const VendorSettings> with_;
  int requested_ = 0;
};

constexpr double range_m = 3;
std::size_t model_of(const Make& make) { return make.name() == "aris" ? 2 : 0; }  // an ARIS 3000 shows 3 m

class Hosts : public testing::TestWithParam<Make> {};
INSTANTIATE_TEST_SUITE_P(OfEveryMake, Hosts, testing::ValuesIn(makes().begin(), makes().end()),
                         [](const auto& of) { return std::string(of.param.name()); });

TEST_P(Hosts, SetWhatIsWantedAndGetPings) {
  const Make& make = GetParam();
  const Wanted wanted = all_that_is_known(make, range_m);
  Talk talk(make, wanted, 0, model_of(make));
  talk.run(30);
  ASSERT_FALSE(talk.error) << talk.error->text;
  EXPECT_TRUE(talk.host->is_open());
  EXPECT_NEAR(talk.settings.range_m, range_m, 0.3) << "as with `sonarctl set sonar --range`";
  if (wanted.settings.gain_percent) {
    EXPECT_NEAR(make.device->gain_percent(talk.state), 50, make.scans ? 50 : 8) << "a Ping360 has three steps";
  }
  if (wanted.settings.rate_hz && !make.each_ping_requested) {
    EXPECT_NEAR(talk.settings.rate_hz, 5, 0.3);
  }
  ASSERT_GT(talk.pings.size(), 2u);
  const HostPing& ping = talk.pings.back();
  EXPECT_THAT(ping.errors, testing::IsEmpty());
  EXPECT_THAT(ping.echo_mismatches, testing::IsEmpty());
  EXPECT_THAT(ping.limited, testing::IsEmpty());
  EXPECT_NEAR(ping.facts.range_m, make.name() == "waterlinked" ? range_m : talk.settings.range_m, 0.2);
  EXPECT_GT(ping.facts.message_size, 50u);
  const auto picture = ping.picture();
  if (!picture) {
    EXPECT_THAT(picture.error().text, HasSubstr("picture"));
  } else {
    EXPECT_GT(picture->rows, 10u);
    EXPECT_EQ(picture->samples.size(), picture->rows * picture->beams);
    EXPECT_EQ(picture->azimuth_rad.size(), picture->beams);
  }
  const auto drawing = drawing_of(ping);
  ASSERT_TRUE(drawing) << drawing.error().text;
  EXPECT_EQ(drawing->kind, make.picture);
  EXPECT_NEAR(drawing->range_m(), ping.facts.range_m, 0.01);
  const FanStyle style{200, *find_colour_map("gray"), true};
  const auto raster = PicturePainter(style).draw(*drawing);
  ASSERT_TRUE(raster) << raster.error().text;
  EXPECT_EQ(raster->height, picture_height(*drawing, style));
}

TEST_P(Hosts, TellTheRangeWhichTheSonarHasInsteadOfThatWhichItEchoes) {
  Wanted wanted;
  wanted.settings.range_m = 900;  // beyond the range of every sonar
  if (!GetParam().host(wanted)) return;
  Talk talk(GetParam(), wanted, 0, model_of(GetParam()));
  talk.run(30);
  if (GetParam().name() == "oculus") {
    ASSERT_FALSE(talk.error) << talk.error->text;
    ASSERT_TRUE(talk.host->expects_echo());
    ASSERT_FALSE(talk.pings.empty());
  }
  if (talk.pings.empty() || !talk.host->expects_echo()) return;  // the host refuses, or reports only the range of each ping
  const HostPing& ping = talk.pings.back();
  EXPECT_LT(ping.facts.range_m, 899);
  EXPECT_THAT(ping.echo_mismatches, testing::IsEmpty());
  EXPECT_THAT(ping.limited, testing::Contains(HasSubstr("not 900 m")));
}

TEST_P(Hosts, FindASonarWithSettingsThatItsModelHas) {
  Wanted nothing;
  nothing.as_it_is = true;
  const Vendor& device = *GetParam().device;
  for (std::size_t i = 0; i < device.models().size(); ++i) {
    Talk talk(GetParam(), nothing, 0, i);
    SCOPED_TRACE(talk.state.model->profile);
    const PingSettings& s = talk.settings;
    ASSERT_GE(s.mode, 0);
    ASSERT_LT(static_cast<std::size_t>(s.mode), talk.state.model->modes.size());
    const FrequencyMode& mode = talk.state.model->modes[static_cast<std::size_t>(s.mode)];
    EXPECT_GT(s.beam_count, 0);
    EXPECT_GT(s.range_bin_count, 0);
    EXPECT_GT(s.range_m, s.range_start_m);
    EXPECT_LE(s.range_m, 1.01 * static_cast<double>(mode.max_range_m));
    EXPECT_NEAR(s.range_start_m + s.range_bin_count * s.range_bin_m, s.range_m, 1.01 * s.range_bin_m);
    EXPECT_GE(s.rate_hz, 0);
    EXPECT_GE(device.gain_percent(talk.state), 0);
    EXPECT_LE(device.gain_percent(talk.state), 100);
    const auto same = device.apply_override({}, talk.state);
    ASSERT_TRUE(same) << same.error().text;
    EXPECT_TRUE(same->vendor_settings->equals(*talk.state.settings)) << same->summary;
  }
}

TEST_P(Hosts, ShowPortAtPort) {
  Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
  talk.only_port = true;
  talk.run(6);
  ASSERT_FALSE(talk.pings.empty());
  const auto drawing = drawing_of(talk.pings.back());
  ASSERT_TRUE(drawing) << drawing.error().text;
  if (drawing->kind == PictureKind::waterfall) return;  // one beam
  if (drawing->kind == PictureKind::sweep) {
    EXPECT_NEAR(std::remainder(drawing->head_rad - talk.head_rad, 2 * pi), 0, 0.02);
    return;
  }
  const PolarImage& image = drawing->image;
  std::size_t port = 0, starboard = 0;
  for (const auto& [azimuth_rad, at_m] : drawing->points) ++(azimuth_rad > 0 ? port : starboard);
  for (std::size_t i = 0; drawing->points.empty() && i < image.samples.size(); ++i)
    if (image.samples[i] > 0) ++(image.azimuth_rad[i % image.beams] > 0 ? port : starboard);
  EXPECT_GT(port, 0u);
  EXPECT_EQ(starboard, 0u);
}

TEST_P(Hosts, ReadTheSameHoweverAStreamIsSplit) {
  const auto pings_of = [](std::size_t piece) {
    Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), piece, model_of(GetParam()));
    talk.run(sonar::test::is_sanitized && !GetParam().scans ? 3 : 6);  // single bytes take long under sanitizers
    std::vector<std::pair<std::uint32_t, std::vector<float>>> all;
    for (const HostPing& ping : talk.pings) all.emplace_back(ping.facts.number, ping.picture().value_or(PolarImage{}).samples);
    return all;
  };
  const auto whole = pings_of(0);
  ASSERT_FALSE(whole.empty());
  for (const std::size_t piece : {1u, 2u, 7u, 16u, 1000u}) EXPECT_EQ(pings_of(piece), whole) << piece;
}

/// Sends the device's bytes, cut or damaged at any place, to a host that has received all bytes before them.
TEST_P(Hosts, SurviveWhatIsCutOffOrDamaged) {
  Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
  talk.run(6);
  const auto [port, last] = talk.sent.back();
  std::mt19937 random(7);
  constexpr int cuts = sonar::test::is_sanitized ? 20 : 100;  // under sanitizers hosts_fuzz damages far more
  for (int i = 0; i < 2 * cuts; ++i) {
    Talk other(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
    other.run(2);
    const std::size_t before = other.pings.size();
    Bytes bytes(last.begin(), last.begin() + static_cast<std::ptrdiff_t>(i < cuts ? random() % last.size() : last.size()));
    bool hits_length = false;  // always true: such a message may include all bytes that follow
    for (std::size_t k = 0; i >= cuts && k < 4; ++k) {
      const std::size_t at = random() % std::min<std::size_t>(bytes.size(), 64);
      hits_length = hits_length || at < 16;
      bytes[at] = static_cast<std::byte>(random());
    }
    other.carry_out(other.host->on_bytes(port, bytes, other.now));
    if (i < cuts) {
      EXPECT_EQ(other.pings.size(), before) << bytes.size() << " of " << last.size() << " bytes";
    }
    for (std::size_t k = before; k < other.pings.size(); ++k) static_cast<void>(other.pings[k].picture());
    const std::size_t before_next = other.pings.size();
    if (i % 10 != 0 || hits_length) continue;
    other.run(8);
    EXPECT_TRUE(other.pings.size() > before_next || other.error) << "the next bytes are read, or the host gives up; input " << i;
  }
}

TEST_P(Hosts, SurviveJunk) {
  std::mt19937 random(11);
  Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
  for (int i = 0; i < 300; ++i) {
    Bytes junk(random() % 3000);
    for (std::byte& b : junk) b = static_cast<std::byte>(random());
    const std::size_t port = talk.make.ports.size() - 1;
    talk.carry_out(talk.host->on_bytes(port, junk, talk.now));
  }
  EXPECT_THAT(talk.pings, testing::IsEmpty());
}

TEST_P(Hosts, RefuseWhatTheyDoNotHave) {
  Wanted wanted;
  wanted.more["no-such-setting"] = "1";
  const auto host = GetParam().host(wanted);
  ASSERT_FALSE(host);
  EXPECT_EQ(host.error().kind, ErrorKind::usage);
  EXPECT_THAT(host.error().text, HasSubstr("--no-such-setting does not apply to " + std::string(GetParam().title)));
  Wanted mode;
  mode.settings.mode = 99;
  const auto far = GetParam().host(mode);
  if (far) {
    Talk talk(GetParam(), mode);  // heads are known from the greeting
    ASSERT_TRUE(talk.error);
    EXPECT_EQ(talk.error->kind, ErrorKind::usage);
  }
}

TEST_P(Hosts, PutTheSonarInStandbyOrSayThatItHasNone) {
  Wanted standby;
  standby.settings.rate_hz = 0;
  const auto host = GetParam().host(standby);
  if (!host) {
    EXPECT_EQ(host.error().kind, ErrorKind::usage);
    return;
  }
  Talk talk(GetParam(), standby, 0, model_of(GetParam()));
  talk.run(3);
  EXPECT_EQ(talk.settings.rate_hz, 0);
  EXPECT_THAT(talk.pings, testing::IsEmpty());
}

TEST_P(Hosts, AskForSlowPingsWhenTheRateIsLessThanTheWireCanSay) {
  for (const double rate_hz : {1e-300, 1e-6}) {
    Wanted slow;
    slow.settings.rate_hz = rate_hz;
    if (!GetParam().host(slow)) continue;  // reports that its rate cannot be set
    Talk talk(GetParam(), slow, 0, model_of(GetParam()));
    talk.run(3);
    EXPECT_LE(talk.settings.rate_hz, 2) << "slower than that an Oculus cannot be";
  }
}

TEST_P(Hosts, SendNoSettingsWhenTheSonarIsToBeLeftAsItIs) {
  Wanted nothing;
  nothing.as_it_is = true;
  Talk talk(GetParam(), nothing, 0, model_of(GetParam()));
  const auto before = talk.state.settings;
  const PingSettings first = GetParam().device->initial_settings(talk.state).settings;
  talk.run(3);
  EXPECT_EQ(talk.settings.range_m, first.range_m);
  EXPECT_EQ(talk.settings.rate_hz, first.rate_hz);
  if (!GetParam().each_ping_requested) {  // a request of a ping names the head, which then becomes the active one
    EXPECT_EQ(talk.state.settings, before);
  }
}

/// All messages of the device, as a recording stores them.
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

TEST(Makes, WithOnePortHaveHostsThatFindOutWhomTheyReached) {
  for (const Make& one : makes())
    for (const Make& other : makes()) {
      if (&one == &other || one.ports.front().number != other.ports.front().number) continue;
      Make mixed = one;
      mixed.host = other.host;
      Talk talk(mixed, {});
      talk.run(6);
      EXPECT_FALSE(talk.error) << talk.error->text;
      EXPECT_FALSE(talk.pings.empty());
      EXPECT_EQ(talk.host->about(), one.title);
    }
}

TEST(Makes, HaveNamesAndPortsOfTheirOwn) {
  for (const Make& one : makes()) {
    EXPECT_FALSE(one.title.empty());
    for (const Make& other : makes())
      if (&one != &other) {
        EXPECT_NE(one.name(), other.name());
        if (!one.shares_port || !other.shares_port) {
          EXPECT_NE(one.ports.front().number, other.ports.front().number);
        }
      }
    bool served = false;
    for (const Port& port : one.device->ports()) served = served || port.number == one.ports.front().number;
    EXPECT_TRUE(served) << "the device listens where its host connects";
  }
}

TEST(Makes, NameWhatEachAddressCarries) {
  const std::vector<Endpoint> status_to{{{10, 0, 0, 255}, 0}};
  for (const Make& one : makes()) {
    const auto addresses = driver_addresses(*one.device, {10, 0, 0, 5}, status_to);
    EXPECT_FALSE(addresses.empty()) << one.name();
    for (const DriverAddress& address : addresses) {
      EXPECT_FALSE(address.carries.empty()) << one.name() << ' ' << address.at.port;
      EXPECT_NE(address.at.port, 0) << one.name();
      EXPECT_LE(line_of(address.protocol, "255.255.255.255:65535", address.carries, address.sonar_speaks_first).size(), 110u);
    }
  }
}

TEST(Makes, AddressLinesOfAnOlderDaemonHaveNoContent) {
  EXPECT_EQ(line_of("tcp", "127.0.0.2:52100", "", false), "tcp        127.0.0.2:52100            waits for the driver");
  EXPECT_EQ(line_of("tcp", "127.0.0.2:52100", "pings", true),
            "tcp        127.0.0.2:52100            pings; sends without a request");
}

}  // namespace
}  // namespace sonar::protocol::hosts_test
