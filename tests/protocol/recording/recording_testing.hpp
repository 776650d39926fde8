// Common parts of the tests of recordings: a small conversation with every kind of message, and temporary files.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "protocol/oculus/encode_ping.hpp"
#include "protocol/oculus/fire.hpp"
#include "protocol/oculus/oculus_log.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar::recording::tests {

enum class Format { oculus_log, raw_dump, pcap, mcap };
inline std::string name_of(Format format) {
  return std::array<const char*, 4>{".oculus log", "raw dump", "capture", "MCAP"}.at(static_cast<std::size_t>(format));
}

inline const Time start = Time(std::chrono::nanoseconds(1'700'000'000'123'456'789));
inline Time after_ms(int ms) { return start + std::chrono::milliseconds(ms); }

inline Bytes bytes_of(const std::string& text) {
  Bytes bytes;
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  return bytes;
}

inline Bytes ping_message(std::uint32_t id, std::uint16_t beams = 4, std::uint16_t rows = 5, unsigned bits = 8) {
  oculus::PingHead head;
  head.fixed.header = {oculus::magic, 7001, 0, oculus::MessageType::ping_result, 0, 0, 0};
  head.fixed.ping_id = id;
  head.fixed.frequency_hz = 2.1e6;
  head.fixed.range_resolution_m = 0.01;
  head.fixed.row_count = rows;
  head.fixed.beam_count = beams;
  head.fixed.data_size = bits == 8 ? oculus::DataSize::bits8 : bits == 16 ? oculus::DataSize::bits16 : oculus::DataSize::bits32;
  std::vector<std::int16_t> bearings(beams);
  Bytes samples(std::size_t{beams} * rows * bits / 8);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::byte>(i * 7 + id);
  for (std::size_t i = 0; i < beams; ++i) bearings[i] = static_cast<std::int16_t>(10 * i);
  return oculus::encode_ping(head, {bearings, {}, samples});
}

inline Bytes dummy_message() {
  oculus::DummyMessage message;
  message.header.type = oculus::MessageType::dummy;
  message.header.source = 7001;
  return wire::bytes_of(message);
}

inline Bytes status_message() {
  oculus::StatusMessage status;
  status.header = {oculus::magic, 7001, 0, oculus::MessageType::status, 0, 126, 1042};
  status.device_id = 7001;
  status.ip_address = {127, 0, 0, 2};
  return wire::bytes_of(status);
}

/// Returns two settings, keep-alives, three pings and a status: messages of both ends, over TCP and UDP.
inline std::vector<RecordedMessage> conversation() {
  using enum Origin;
  using enum Carrier;
  const Bytes fire = oculus::make_fire({});
  return {{after_ms(0), device, stream, dummy_message()},    {after_ms(1), client, stream, fire},
          {after_ms(100), device, stream, ping_message(1)},  {after_ms(150), device, datagram, status_message()},
          {after_ms(200), device, stream, ping_message(2)},  {after_ms(250), client, stream, fire},
          {after_ms(4300), device, stream, ping_message(3)}, {after_ms(4400), device, stream, dummy_message()}};
}

inline std::vector<RecordedMessage> read_all(RecordingReader& reader) {
  std::vector<RecordedMessage> messages;
  while (auto message = reader.next()) messages.push_back(std::move(*message));
  return messages;
}

/// Returns the bytes that the device sent over TCP.
inline Bytes device_stream(const std::vector<RecordedMessage>& messages) {
  Bytes stream;
  for (const RecordedMessage& message : messages)
    if (message.from == Origin::device && message.by == Carrier::stream)
      stream.insert(stream.end(), message.bytes.begin(), message.bytes.end());
  return stream;
}

inline void expect_same(const std::vector<RecordedMessage>& found, const std::vector<RecordedMessage>& expected,
                        bool with_times = true) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(found[i].from, expected[i].from);
    EXPECT_EQ(found[i].by, expected[i].by);
    EXPECT_EQ(found[i].bytes, expected[i].bytes);
    if (with_times) {
      EXPECT_EQ(found[i].at, expected[i].at);
    }
  }
}

inline std::unique_ptr<RecordingWriter> writer_for(Format format, std::unique_ptr<Sink> sink) {
  switch (format) {
    case Format::oculus_log:
      return write_oculus_log(std::move(sink));
    case Format::raw_dump:
      return write_raw_dump(std::move(sink));
    case Format::pcap:
      return write_pcap(std::move(sink), {});
    default:
      return std::make_unique<McapSession>(std::move(sink), "front");
  }
}

/// Returns the messages of a conversation that this format can store.
inline std::vector<RecordedMessage> kept_by(Format format, std::vector<RecordedMessage> messages) {
  if (format == Format::oculus_log || format == Format::raw_dump)
    std::erase_if(messages, [](const RecordedMessage& message) {
      return message.from == Origin::client || message.by == Carrier::datagram;
    });
  return messages;
}

inline Bytes recorded(Format format, const std::vector<RecordedMessage>& messages) {
  Bytes file;
  const auto writer = writer_for(format, sink_into(file));
  for (const RecordedMessage& message : messages) EXPECT_TRUE(writer->write(message));
  EXPECT_TRUE(writer->close());
  return file;
}

inline Result<Recording> open_bytes(Bytes bytes, const std::string& sonar = {}) {
  return open_recording(source_from("a file", std::move(bytes)), sonar);
}

inline const std::vector<Format> all_formats{Format::oculus_log, Format::raw_dump, Format::pcap, Format::mcap};

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / (std::to_string(::getpid()) + "-" + name)) {}
  ~TemporaryFile() {
    std::error_code ec;
    std::filesystem::remove(path_, ec);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace sonar::recording::tests
