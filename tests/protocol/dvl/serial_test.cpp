// Compares the serial protocol of a DVL with its published description: sentences, checksums and commands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"
#include "tests/protocol/dvl/dvl_testing.hpp"

namespace sonar::dvl {
namespace {

using namespace std::chrono_literals;
using namespace tests;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// Returns the sentences of a text without their checksums, which it checks.
std::vector<std::string> sentences_in(std::string_view text) {
  std::vector<std::string> all;
  while (!text.empty()) {
    const std::size_t end = text.find("\r\n");
    EXPECT_NE(end, std::string_view::npos) << text;
    if (end == std::string_view::npos) break;
    const std::string_view line = text.substr(0, end), body = line.substr(0, line.rfind('*'));
    EXPECT_EQ(text_of(sentence_line(body)), std::string(line) + "\r\n");
    all.emplace_back(body);
    text.remove_prefix(end + 2);
  }
  return all;
}

/// Uses the examples of the documentation.
TEST(DvlSentences, ChecksumsAreThoseOfTheExamples) {
  EXPECT_EQ(crc8("123456789"), 0xF4);
  EXPECT_EQ(text_of(sentence_line("wrx,1164.94,0.000,0.000,0.000,2.707,-1.00,n,1")),
            "wrx,1164.94,0.000,0.000,0.000,2.707,-1.00,n,1*39\r\n");
  EXPECT_EQ(crc8("wru,0,0.070,1.10,-40,-95"), 0x9C);
  EXPECT_EQ(crc8("wrp,49056.809,0.41,0.15,1.23,0.4,53.9,13.0,19.3,0"), 0xDE);
}

Measurement measured() {
  Measurement m;
  m.is_valid = true;
  m.velocity_mps = {0.12, -0.4, 2};
  m.altitude_m = 1.3;
  m.fom = 1.855;
  m.covariance[0][0] = 1e-7;
  m.covariance[2][2] = 0.25;
  m.reflected_at = Time(1'700'000'000s) + 7us;
  for (std::size_t i = 0; i < beam_count; ++i) m.beams[i] = {true, 0.07, 0, 1.25, -40.4};
  m.beams[3] = {false, 0, 0, -1, -150};
  return m;
}

TEST(DvlSentences, APingHasTheFieldsOfTheDocumentation) {
  const auto lines = [](SerialOutput output) {
    return sentences_in(text_of(velocity_sentences(measured(), 123ms, Time(1'700'000'000s) + 14us, output)));
  };
  EXPECT_THAT(
      lines(SerialOutput::old_and_new),
      ElementsAre("wrx,123.00,0.120,-0.400,2.000,1.855,1.30,y,0", "wrt,1.25,1.25,1.25,-1.00",
                  "wrz,0.120,-0.400,2.000,y,1.30,1.855,1e-07;0;0;0;0;0;0;0;0.25,1700000000000007,1700000000000014,123.00,0",
                  "wru,0,0.070,1.25,-40,-90", "wru,1,0.070,1.25,-40,-90", "wru,2,0.070,1.25,-40,-90",
                  "wru,3,0.000,-1.00,-150,-90"));
  EXPECT_THAT(lines(SerialOutput::new_ones), SizeIs(5));
  EXPECT_THAT(lines(SerialOutput::none), IsEmpty());
}

const protocol::Port& port_of(std::uint16_t number) {
  return *std::ranges::find(vendor().ports(), number, &protocol::Port::number);
}

/// A driver at the port for the serial protocol.
struct Line {
  std::vector<std::string> ask(std::string_view sent) { return take(serial->on_bytes(bytes_of(sent), now)); }
  std::vector<std::string> take(const protocol::Reaction& reaction) {
    for (const protocol::Event& event : reaction.events) {
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) state.settings = change->vendor_settings;
      requests += std::holds_alternative<protocol::RequestPing>(event);
      if (const auto* notice = std::get_if<protocol::Notice>(&event)) noticed = notice->text;
      ++events;
    }
    std::string all;
    for (const Bytes& reply : reaction.replies) all += text_of(reply);
    return sentences_in(all);
  }
  std::size_t lines_of_a_ping() {
    const auto parts =
        vendor().datagrams(port_of(serial_port), ping_of({2, 2, 2, 2}, settings_from(state.settings.get()), state), state);
    return parts.empty() ? 0 : sentences_in(text_of(parts.at(0))).size();
  }
  protocol::DeviceState state = device();
  Time now = Time(1'700'000'000s) + 50ms;
  std::unique_ptr<protocol::Dialogue> serial = vendor().converse(port_of(serial_port), state, now);
  std::string noticed;
  int requests = 0, events = 0;
};

TEST(DvlSerial, CommandsAreAnswered) {
  Line line;
  EXPECT_THAT(line.ask("wcv\r\n"), ElementsAre("wrv,2.8.0"));
  EXPECT_THAT(line.ask("wcw\n"), ElementsAre("wrw,dvl-a50,2.7.2,0x00000000001b59"));
  EXPECT_THAT(line.ask("wcc\r"), ElementsAre("wrc,1475,0,y,n,auto,y"));
  EXPECT_THAT(line.ask("wcs,1450,,,y,=1,n\nwcc\n"), ElementsAre("wra", "wrc,1450,0,y,y,=1,n"));
  EXPECT_THAT(line.ask("wcs,,90,,\nwcc\n"), ElementsAre("wra", "wrc,1450,90,y,y,=1,n"))
      << "versions without range modes send this shorter command";
  EXPECT_THAT(line.ask("wcr\nwcg\n"), ElementsAre("wra", "wra"));
  EXPECT_THAT(line.ask("wcN\nwcn,10.0.0.1\nwcN\n"), ElementsAre("wrN,auto", "wra", "wrN,10.0.0.1"));
  line.state.powered_up_at = line.now - 45s;
  EXPECT_THAT(line.ask("wct\n"), ElementsAre("wrs,1700000000050000,y,10.0.0.1,45"));
  EXPECT_THAT(line.ask("wcT,5\nwcm,1700000000000000\n"), ElementsAre("wrT,y", "wrn"))
      << "a device with a synchronised clock refuses the time";
}

TEST(DvlSerial, MalformedUnknownAndRefusedCommandsDiffer) {
  Line line;
  for (const char* malformed : {"hello", "wrv", "wc", "wcvv", "wcq", "wcv,1", "wcs,1,2", "wcs,1,2,y,y,auto,y,y", "wcs,fast,,,",
                                "wcs,,,yes,", "wcp", "wcT,soon", "wcm"})
    EXPECT_THAT(line.ask(malformed + std::string("\n")), ElementsAre("wr?")) << malformed;
  EXPECT_EQ(line.noticed, "no command: wcm");
  for (const char* refused : {"wcs,999,,,", "wcs,,361,,", "wcs,1490,,,,wt,", "wcs,1490,,,,9,", "wcx", "wcp,2", "wcp,6", "wcp,7"})
    EXPECT_THAT(line.ask(refused + std::string("\n")), ElementsAre("wrn")) << refused;
  EXPECT_THAT(line.ask("wcc\n"), ElementsAre(HasSubstr("wrc,1475,0")));
}

TEST(DvlSerial, AChecksumIsOptionalAndCheckedIfGiven) {
  Line line;
  const std::string right = text_of(sentence_line("wcv"));
  EXPECT_THAT(line.ask(right), ElementsAre("wrv,2.8.0"));
  for (const char* wrong : {"wcv*00", "wcv*", "wcv*7", "wcv*zz", "wcv*0x", "wcv*+1"})
    EXPECT_THAT(line.ask(wrong + std::string("\n")), ElementsAre("wr!")) << wrong;
}

TEST(DvlSerial, ASentenceMayComeInPiecesWithinATimeLimit) {
  Line line;
  for (const char* piece : {"w", "c", "v"}) {
    EXPECT_THAT(line.ask(piece), IsEmpty());
    line.now += 9ms;
    EXPECT_GT(line.serial->next_tick(), line.now);
  }
  EXPECT_THAT(line.ask("\n"), ElementsAre("wrv,2.8.0"));
  line.ask("wcv");
  line.now += 10ms;
  EXPECT_LE(line.serial->next_tick(), line.now);
  EXPECT_THAT(line.take(line.serial->on_tick(line.now, false)), ElementsAre("wr?"));
  EXPECT_THAT(line.ask("\nwcv\n"), ElementsAre("wrv,2.8.0"));
  EXPECT_THAT(line.ask(std::string(100'000, 'w') + "\nwcv\n"), ElementsAre("wr?", "wrv,2.8.0"));
  line.events = 0;
  std::string many;
  for (int i = 0; i < 10'000; ++i) many += "wcr\n";
  line.ask(many);
  EXPECT_LE(line.events, 32);
}

TEST(DvlSerial, TheOutputIsSelectedForAllDrivers) {
  Line line;
  EXPECT_EQ(line.lines_of_a_ping(), 7u);
  EXPECT_THAT(line.ask("wcp,3\n"), ElementsAre("wra"));
  EXPECT_EQ(line.lines_of_a_ping(), 5u);
  line.now += 200ms;
  EXPECT_THAT(line.take(line.serial->on_tick(line.now, false)),
              ElementsAre(HasSubstr("wrp,1700000000.250,0.00,0.00,0.00,0.000,0.0")));
  EXPECT_THAT(line.ask("wcp,0\n"), ElementsAre("wra"));
  EXPECT_EQ(line.lines_of_a_ping(), 0u);
  line.now += 200ms;
  EXPECT_THAT(line.take(line.serial->on_tick(line.now, false)), IsEmpty());
  EXPECT_THAT(line.ask("wcv\n"), ElementsAre("wrv,2.8.0")) << "commands are still answered";
}

TEST(DvlSerial, PingsAreTriggered) {
  Line line;
  EXPECT_THAT(line.ask("wcs,,,n,\nwcx\nwcx\n"), ElementsAre("wra", "wra", "wra"));
  EXPECT_EQ(line.requests, 1);
  EXPECT_THAT(line.serial->on_ping(nullptr, 1, line.now).events, SizeIs(1));
  EXPECT_THAT(line.serial->on_ping(nullptr, 1, line.now).events, IsEmpty());
}

TEST(DvlSerial, BothLinesShareTheSettings) {
  Line line;
  const auto tcp = vendor().converse(port_of(tcp_port), line.state, line.now);
  const std::string_view command = R"({"command":"set_config","parameters":{"speed_of_sound":1500}})";
  for (const protocol::Event& event : tcp->on_bytes(bytes_of(command), line.now).events)
    if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) line.state.settings = change->vendor_settings;
  EXPECT_THAT(line.ask("wcc\n"), ElementsAre("wrc,1500,0,y,n,auto,y"));
}

}  // namespace
}  // namespace sonar::dvl
