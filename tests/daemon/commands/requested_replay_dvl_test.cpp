// Replay of a DVL at both of its ports: JSON as recorded, and the sentences of the serial protocol, made of this JSON.
#include <gtest/gtest.h>

#include "protocol/dvl/dvl.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "tests/daemon/commands/requested_replay_testing.hpp"
#include "tests/protocol/dvl/dvl_testing.hpp"

namespace sonar::requested_replay_test {
namespace {

using dvl::tests::bytes_of;
using dvl::tests::text_of;

const std::string velocity =
    R"({"time":200,"vx":0.5,"vy":-0.25,"vz":0.125,"fom":0.002,"covariance":[[1e-06,0,0],[0,2e-06,0],[0,0,3e-07]],)"
    R"("altitude":2.5,"transducers":[{"id":0,"velocity":0.1,"distance":2.7,"rssi":-30,"nsd":-94,"beam_valid":true},)"
    R"({"id":1,"velocity":-0.2,"distance":2.71,"rssi":-31,"nsd":-95,"beam_valid":true},)"
    R"({"id":2,"velocity":0.3,"distance":2.72,"rssi":-32,"nsd":-96,"beam_valid":true},)"
    R"({"id":3,"velocity":0,"distance":-1,"rssi":-33,"nsd":-97,"beam_valid":false}],)"
    R"("velocity_valid":true,"status":1,"format":"json_v3.1","type":"velocity",)"
    R"("time_of_validity":1638191471563017,"time_of_transmission":1638191471752336})"
    "\r\n";
const std::string position = R"({"ts":1638191471.75,"x":1.5,"y":-2.25,"z":0.5,"std":0.012,"roll":1.5,"pitch":-2.5,"yaw":90,)"
                             R"("type":"position_local","status":0,"format":"json_v3.1"})"
                             "\r\n";
const std::string response =
    R"({"response_to":"get_config","success":true,"error_message":"","result":null,"format":"json_v3.1",)"
    R"("type":"response"})"
    "\r\n";
// Sentences typed from the table of the serial protocol, with checksums computed by another program.
const std::string old_sentences =
    "wrx,200.00,0.500,-0.250,0.125,0.002,2.50,y,1*a9\r\n"
    "wrt,2.70,2.71,2.72,-1.00*91\r\n";
const std::string new_sentences =
    "wrz,0.500,-0.250,0.125,y,2.50,0.002,1e-06;0;0;0;2e-06;0;0;0;3e-07,1638191471563017,1638191471752336,"
    "200.00,1*02\r\n"
    "wru,0,0.100,2.70,-30,-94*d4\r\n"
    "wru,1,-0.200,2.71,-31,-95*fa\r\n"
    "wru,2,0.300,2.72,-32,-96*b0\r\n"
    "wru,3,0.000,-1.00,-33,-97*a3\r\n";
const std::string position_sentence = "wrp,1638191471.750,1.50,-2.25,0.50,0.012,1.5,-2.5,90.0,0*4a\r\n";

Bytes dump(std::initializer_list<std::string> lines) {
  std::vector<Bytes> messages;
  for (const std::string& line : lines) messages.push_back(bytes_of(line));
  return file_of(raw_dump, messages);
}

struct ReplayOfDvl : ::testing::Test {
  /// Reads until the device has answered, so that the client is served.
  static std::string answer(Tcp& client, std::string_view command, std::string_view end) {
    client.send(command);
    std::string text;
    while (!text.ends_with(end)) {
      const Bytes piece = client.read();
      if (piece.empty()) break;
      text += text_of(piece);
    }
    return text;
  }
  std::promise<void> goes_on;  // the disk of the recording blocks until this has a value
};

TEST_F(ReplayOfDvl, BothPortsGetEachReportAndTheDeviceItselfAnswers) {
  Replay replay(dump({velocity, response, position, velocity}), 1000, goes_on.get_future().share());
  Tcp json(dvl::tcp_port), serial(dvl::serial_port);
  EXPECT_NE(answer(json, R"({"command":"get_config"})", "}\r\n").find(R"("success":true)"), std::string::npos);
  EXPECT_EQ(answer(serial, "wcv\r\n", "\r\n").substr(0, 4), "wrv,");
  goes_on.set_value();
  auto sentences = std::async(std::launch::async, [&] { return text_of(serial.read_to_end()); });
  EXPECT_EQ(text_of(json.read_to_end()), velocity + position + velocity);
  EXPECT_EQ(sentences.get(), old_sentences + new_sentences + position_sentence + old_sentences + new_sentences);
  EXPECT_TRUE(replay.ends());
  EXPECT_EQ(replay.figures().messages, 3u);
}

TEST_F(ReplayOfDvl, ADriverSelectsTheSentences) {
  Replay replay(dump({velocity, velocity, position}), 1000, goes_on.get_future().share());
  Tcp serial(dvl::serial_port);
  EXPECT_EQ(answer(serial, "wcp,3\r\n", "\r\n").substr(0, 3), "wra");
  goes_on.set_value();
  const std::string all = text_of(serial.read_to_end());
  // The first report was read from the recording before the command came.
  EXPECT_EQ(all.substr(all.size() - (new_sentences + position_sentence).size()), new_sentences + position_sentence);
  EXPECT_EQ(all.find("wrx", old_sentences.size()), std::string::npos);
}

/// Returns an MCAP file of these lines, five per second, that states a profile.
Bytes mcap_file(const std::string& profile, std::initializer_list<std::string> lines) {
  Bytes file;
  recording::McapSession writer(recording::sink_into(file), "dvl", *protocol::find_make("dvl"), profile);
  Time at(std::chrono::seconds(1'700'000'000));
  for (const std::string& line : lines) {
    EXPECT_TRUE(writer.write({at, Origin::device, Carrier::stream, bytes_of(line)}));
    at += milliseconds(200);
  }
  EXPECT_TRUE(writer.close());
  return file;
}

/// An emulated device reports its position five times a second. The longer replay must send only the recorded position.
TEST_F(ReplayOfDvl, OnlyRecordedPositionsAreSent) {
  const auto lines = {velocity, velocity, velocity, position};
  for (const Bytes& file : {dump(lines), mcap_file("dvl-a50", lines), mcap_file("dvl-a125", lines)}) {
    Replay replay(file, 5.0);
    Tcp json(dvl::tcp_port);
    EXPECT_EQ(text_of(json.read_to_end()), velocity + velocity + velocity + position);
  }
}

TEST_F(ReplayOfDvl, TheProductIsThatOfTheRecording) {
  for (const auto& [profile, name] : {std::pair{"dvl-a50", "DVL A50"}, std::pair{"dvl-a125", "DVL A125"}}) {
    std::promise<void> goes_on_now;
    Replay replay(mcap_file(profile, {velocity}), 1000, goes_on_now.get_future().share());
    Tcp json(dvl::tcp_port);
    EXPECT_NE(answer(json, R"({"command":"get_version_info"})", "}\r\n").find(name), std::string::npos) << profile;
    goes_on_now.set_value();
  }
}

TEST_F(ReplayOfDvl, DisabledAcousticsHoldTheRecordingAndATriggerGetsTheNextReport) {
  Replay replay(dump({velocity, position, velocity}), 1000, goes_on.get_future().share());
  Tcp json(dvl::tcp_port);
  EXPECT_NE(answer(json, R"({"command":"set_config","parameters":{"acoustic_enabled":false}})", "}\r\n").find("true"),
            std::string::npos);
  goes_on.set_value();
  EXPECT_EQ(answer(json, "", "\r\n"), velocity) << "this report was read before the command";
  std::string after = answer(json, R"({"command":"trigger_ping"})", "}\r\n");
  EXPECT_EQ(after.find(R"({"response_to":"trigger_ping","success":true)"), 0u)
      << "the recording is held until the trigger: " << after;
  if (!after.ends_with(position)) after += answer(json, "", "}\r\n");
  EXPECT_TRUE(after.ends_with(position)) << after;
}

}  // namespace
}  // namespace sonar::requested_replay_test
