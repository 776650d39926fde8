// Compares the message table with the rules of MAVLink: CRC_EXTRA follows from the names and types of the fields, the
// length from their sizes, and their order from their sizes.
#include "protocol/mavlink/messages.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace sonar::mavlink {
namespace {

/// Lists names, types and array lengths as message definitions spell them.
struct Listed : wire::Visitor<Listed> {
  struct Row {
    std::string type, name;
    std::size_t size = 0,
                count = 0;  // size of an element [bytes]; number of elements of an array, 0 if the field is not an array
  };
  std::vector<Row> rows;

  template <class T>
  static std::string type_name() {
    if constexpr (std::is_enum_v<T>) return type_name<std::underlying_type_t<T>>();
    if constexpr (std::is_same_v<T, float>) return "float";
    return std::string(std::is_signed_v<T> ? "int" : "uint").append(std::to_string(8 * sizeof(T))).append("_t");
  }
  template <class T>
  void scalar(std::string_view name, const T&) {
    rows.push_back({type_name<T>(), std::string(name), sizeof(T), 0});
  }
  template <class T, std::size_t n>
  void array(std::string_view name, const std::array<T, n>&) {
    rows.push_back({type_name<T>(), std::string(name), sizeof(T), n});
  }
};

/// Computes the checksum bit by bit; the program uses a table.
std::uint16_t plain_checksum(const std::string& text) {
  unsigned crc = 0xFFFF;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0x8408u : 0u);
  }
  return static_cast<std::uint16_t>(crc);
}

template <class M>
void expect_by_the_rule(std::size_t size, std::size_t full) {
  SCOPED_TRACE(M::name);
  Listed base;
  const M message{};
  fields(base, message);
  std::string seed = std::string(M::name) + " ";
  std::size_t last_size = 8;
  for (const Listed::Row& row : base.rows) {
    seed += row.type + " " + row.name + " ";
    if (row.count > 0) seed += static_cast<char>(row.count);
    EXPECT_LE(row.size, last_size) << row.name << " is too late: fields are sorted by size";
    last_size = row.size;
  }
  const std::uint16_t crc = plain_checksum(seed);
  EXPECT_EQ(M::crc_extra, (crc & 0xFF) ^ (crc >> 8));
  EXPECT_EQ(wire::wire_size<M>(), size);
  EXPECT_EQ(full_size<M>(), full);
}

TEST(MavlinkMessages, CrcExtraAndLengthsFollowFromTheFields) {
  expect_by_the_rule<Heartbeat>(9, 9);
  expect_by_the_rule<SystemTime>(12, 12);
  expect_by_the_rule<Attitude>(28, 28);
  expect_by_the_rule<AttitudeQuaternion>(32, 48);
  expect_by_the_rule<LocalPositionNed>(28, 28);
  expect_by_the_rule<GlobalPositionInt>(28, 28);
  expect_by_the_rule<GpsGlobalOrigin>(12, 20);
  expect_by_the_rule<VfrHud>(20, 20);
  expect_by_the_rule<CommandLong>(33, 33);
  expect_by_the_rule<CommandAck>(3, 10);
  expect_by_the_rule<DistanceSensor>(14, 39);
  expect_by_the_rule<VisionPositionEstimate>(32, 117);
  expect_by_the_rule<SimState>(84, 92);
  expect_by_the_rule<AttPosMocap>(36, 120);
  expect_by_the_rule<Odometry>(230, 233);
}

TEST(MavlinkMessages, TheTableHasNumbersAndChecksums) {
  const std::vector<std::pair<std::uint32_t, int>> wanted{{0, 50},   {2, 137},   {30, 39}, {31, 246}, {32, 185},
                                                          {33, 104}, {49, 39},   {74, 20}, {76, 152}, {102, 158},
                                                          {108, 32}, {138, 109}, {331, 91}};
  ASSERT_EQ(known_messages().size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(known_messages()[i].id, wanted[i].first);
    EXPECT_EQ(known_messages()[i].crc_extra, wanted[i].second);
    EXPECT_EQ(find_message(wanted[i].first), &known_messages()[i]);
  }
  EXPECT_EQ(find_message(77), nullptr) << "sonard writes answers to commands, but reads none";
}

}  // namespace
}  // namespace sonar::mavlink
