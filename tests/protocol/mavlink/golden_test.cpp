// Tests with frames that an independent writer (tests/acceptance/mavlink_frames.py) made from the message definitions: we must
// read every field correctly and write the same bytes.
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink {
namespace {

/// Collects the values of each field, as the golden file prints them.
struct FieldValues : wire::Visitor<FieldValues> {
  std::map<std::string, std::string> values;
  template <class T>
  void scalar(std::string_view name, const T& value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", static_cast<double>(value));
    std::string& all = values[std::string(name)];
    all.append(all.empty() ? "" : ",").append(text);
  }
};

struct Golden {
  int version = 0;
  std::string name, hex;
  std::map<std::string, std::string> values;
};
std::vector<Golden> golden() {
  std::ifstream file(std::string(SONARD_SOURCE_DIR) + "/tests/protocol/mavlink/golden/frames.txt");
  std::vector<Golden> all;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    Golden g;
    words >> g.version >> g.name >> g.hex;
    for (std::string word; words >> word;) g.values[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
    all.push_back(std::move(g));
  }
  return all;
}

template <class M>
void expect_read_and_written(const Golden& g, const Frame& frame) {
  const M message = message_in<M>(frame);
  FieldValues found;
  if (g.version == 2)
    all_fields(found, message);
  else
    fields(found, message);
  EXPECT_EQ(found.values, g.values);
  Sender same{{frame.system, frame.component, frame.sequence}};
  EXPECT_EQ(g.version == 2 ? same(message) : same.version_1(message), bytes_of_hex(g.hex));
}

void expect(const Golden& g, const Frame& frame) {
  switch (frame.id) {
    case 0:
      return expect_read_and_written<Heartbeat>(g, frame);
    case 2:
      return expect_read_and_written<SystemTime>(g, frame);
    case 30:
      return expect_read_and_written<Attitude>(g, frame);
    case 31:
      return expect_read_and_written<AttitudeQuaternion>(g, frame);
    case 32:
      return expect_read_and_written<LocalPositionNed>(g, frame);
    case 33:
      return expect_read_and_written<GlobalPositionInt>(g, frame);
    case 49:
      return expect_read_and_written<GpsGlobalOrigin>(g, frame);
    case 74:
      return expect_read_and_written<VfrHud>(g, frame);
    case 102:
      return expect_read_and_written<VisionPositionEstimate>(g, frame);
    case 108:
      return expect_read_and_written<SimState>(g, frame);
    case 138:
      return expect_read_and_written<AttPosMocap>(g, frame);
    case 331:
      return expect_read_and_written<Odometry>(g, frame);
    default:
      ADD_FAILURE() << "no such message: " << frame.id;
  }
}

CommandLong golden_command() {
  CommandLong m;
  m.param1 = 7.25f, m.param2 = 7.5f, m.param3 = 7.75f, m.param4 = 8, m.param5 = 8.25f, m.param6 = 8.5f, m.param7 = 8.75f;
  m.command = 15, m.target_system = 16, m.target_component = 17;
  return m;
}

TEST(MavlinkGolden, FramesOfAnotherWriterAreReadAndWrittenEqually) {
  const std::vector<Golden> all = golden();
  ASSERT_EQ(all.size(), 25u) << "13 messages in version 2, and in version 1 all except ODOMETRY";
  Bytes joined;
  std::size_t read = 0;
  for (const Golden& g : all) {
    SCOPED_TRACE(g.name + ", version " + std::to_string(g.version));
    const Bytes frame = bytes_of_hex(g.hex);
    joined = joined + frame;
    FrameReader reader(frame);
    const auto found = reader.next();
    ASSERT_TRUE(found);
    if (g.name == CommandLong::name) {
      Sender same{{8, 207, 107}};
      EXPECT_EQ(g.version == 2 ? same(golden_command()) : same.version_1(golden_command()), frame);
      EXPECT_EQ(wire::bytes_of(message_in<CommandLong>(*found)), wire::bytes_of(golden_command()));
      ++read;
      continue;
    }
    EXPECT_EQ(found->version, g.version);
    EXPECT_EQ(find_message(found->id)->name, g.name);
    expect(g, *found);
    ++read;
  }
  FrameReader reader(joined);
  std::size_t in_one = 0;
  while (reader.next()) ++in_one;
  EXPECT_EQ(in_one, read);
  EXPECT_EQ(reader.counts().unknown, 0u);
  EXPECT_EQ(reader.counts().junk_bytes, 0u);
}

}  // namespace
}  // namespace sonar::mavlink
