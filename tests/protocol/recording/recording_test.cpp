// Tests the rules of every format: written messages can be read again, also from a part of the file, and a full disk does not
// damage messages that were written before.
#include "tests/protocol/recording/recording_testing.hpp"
#include "tests/small_disk.hpp"

namespace sonar::recording::tests {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class EveryFormat : public ::testing::TestWithParam<Format> {};
INSTANTIATE_TEST_SUITE_P(Recording, EveryFormat, ::testing::ValuesIn(all_formats), [](const auto& format) {
  std::string name = name_of(format.param);
  std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
  return name;
});

TEST_P(EveryFormat, ReturnsTheWrittenMessages) {
  auto opened = open_bytes(recorded(GetParam(), conversation()));
  ASSERT_TRUE(opened) << opened.error().text;
  EXPECT_EQ(opened->format, name_of(GetParam()));
  for (int round = 0; round < 2; ++round) {
    expect_same(read_all(*opened->reader), kept_by(GetParam(), conversation()), opened->reader->knows_times());
    EXPECT_FALSE(opened->reader->damage());
    opened->reader->rewind();
  }
}

TEST_P(EveryFormat, KeepsLongMessages) {
  std::vector<RecordedMessage> messages;
  for (std::uint32_t i = 0; i < 4; ++i)
    messages.push_back({after_ms(100 * static_cast<int>(i)), Origin::device, Carrier::stream, ping_message(i, 512, 700, 32)});
  auto opened = open_bytes(recorded(GetParam(), messages));
  ASSERT_TRUE(opened) << opened.error().text;
  expect_same(read_all(*opened->reader), messages, opened->reader->knows_times());
}

TEST_P(EveryFormat, ReturnsTheCompleteMessagesOfATruncatedFile) {
  const std::vector<RecordedMessage> written = kept_by(GetParam(), conversation());
  const Bytes whole = recorded(GetParam(), conversation());
  std::size_t most = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    auto opened = open_bytes({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    if (!opened) {
      EXPECT_EQ(opened.error().kind, ErrorKind::bad_data);
      EXPECT_EQ(most, 0u) << "at " << size << " of " << whole.size() << ": " << opened.error().text;
      continue;
    }
    const std::vector<RecordedMessage> messages = read_all(*opened->reader);
    ASSERT_LE(messages.size(), written.size());
    ASSERT_GE(messages.size() + 1, most)
        << size;  // a longer file has at most one message fewer, because of the order of the last two
    for (const RecordedMessage& message : messages) {
      const auto same = [&message](const RecordedMessage& other) {
        return other.bytes == message.bytes && other.from == message.from;
      };
      ASSERT_TRUE(std::any_of(written.begin(), written.end(), same)) << "cut at " << size;
    }
    most = std::max(most, messages.size());
  }
  EXPECT_GE(most + 1, written.size());
}

TEST_P(EveryFormat, SurvivesAnyWrongByte) {
  const std::vector<RecordedMessage> messages{{start, Origin::device, Carrier::stream, dummy_message()},
                                              {after_ms(10), Origin::device, Carrier::stream, dummy_message()}};
  const Bytes whole = recorded(GetParam(), messages);
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const unsigned flip : {0x01u, 0x80u, 0xFFu}) {
      Bytes damaged = whole;
      damaged[at] ^= static_cast<std::byte>(flip);
      auto opened = open_bytes(damaged);
      if (opened) {
        EXPECT_LE(read_all(*opened->reader).size(), 4u);
      }
    }
}

TEST_P(EveryFormat, AFullDiskKeepsTheWrittenMessages) {
  const TemporaryFile file("full-disk");
  std::vector<RecordedMessage> written;
  std::optional<Error> error;
  {
    auto sink = create_sink(file.path());
    ASSERT_TRUE(sink);
    const SmallDisk disk(3'000'000);
    const auto writer = writer_for(GetParam(), std::move(*sink));
    for (std::uint32_t i = 0; i < 400 && !error; ++i) {
      RecordedMessage message{after_ms(100 * static_cast<int>(i)), Origin::device, Carrier::stream, ping_message(i, 256, 100)};
      if (Result<void> done = writer->write(message); !done) error = done.error();
      written.push_back(std::move(message));
    }
    ASSERT_TRUE(error);
    EXPECT_FALSE(writer->write(written.front()));
    static_cast<void>(writer->close());
  }
  EXPECT_EQ(error->kind, ErrorKind::io);
  EXPECT_THAT(error->text, HasSubstr("cannot write more to " + file.path().string()));
  EXPECT_THAT(error->text, HasSubstr("bytes are whole"));

  auto opened = open_recording(file.path());
  ASSERT_TRUE(opened) << opened.error().text;
  const std::vector<RecordedMessage> found = read_all(*opened->reader);
  EXPECT_FALSE(opened->reader->damage()) << opened->reader->damage()->text;
  ASSERT_GT(found.size(), GetParam() == Format::mcap ? 20u : 90u);
  written.resize(found.size());
  expect_same(found, written, opened->reader->knows_times());
}

TEST(Recording, AFileThatIsBeingWrittenIsRefusedAndKept) {
  const TemporaryFile file("written.bin");
  auto first = create_sink(file.path());
  ASSERT_TRUE(first);
  ASSERT_TRUE((*first)->append(std::as_bytes(std::span("first", 5))));
  const auto second = create_sink(file.path());
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().text, HasSubstr("is being written by another program"));
  ASSERT_TRUE((*first)->close());
  EXPECT_EQ(std::filesystem::file_size(file.path()), 5u);
  first->reset();
  EXPECT_TRUE(create_sink(file.path()));
  EXPECT_EQ(std::filesystem::file_size(file.path()), 0u);
}

TEST(Recording, ARemovedOrTruncatedFileIsReported) {
  const TemporaryFile file("lost.bin");
  const auto close_after = [&](auto&& change) {
    auto sink = create_sink(file.path());
    EXPECT_TRUE((*sink)->append(std::as_bytes(std::span("first", 5))));
    change();
    EXPECT_TRUE((*sink)->append(std::as_bytes(std::span("then", 4))));
    const Result<void> closed = (*sink)->close();
    return closed ? "" : closed.error().text;
  };
  EXPECT_EQ(close_after([] {}), "");
  const TemporaryFile other("other.bin");
  const auto replace = [&] {
    std::ofstream(other.path()) << "second";
    std::filesystem::rename(other.path(), file.path());
  };
  EXPECT_THAT(close_after(replace), HasSubstr("replaced while it was being written"));
  EXPECT_THAT(close_after([&] { std::filesystem::remove(file.path()); }),
              HasSubstr("was removed or replaced while it was being written"));
  EXPECT_THAT(close_after([&] { std::filesystem::resize_file(file.path(), 20); }), HasSubstr("another program changed it"));
}

TEST(Recording, RefusesOtherFiles) {
  const auto text_of = [](const std::string& content) {
    auto opened = open_bytes(bytes_of(content));
    EXPECT_FALSE(opened);
    return opened ? "" : opened.error().text;
  };
  EXPECT_EQ(text_of(""), "a file is empty");
  EXPECT_THAT(text_of("hello"),
              HasSubstr("not a recording: expected pcapng, .pcap, .mcap, .raw, .oculus, .aris, .sonar, .svlog"));
  EXPECT_THAT(text_of("SQLite format 3"), HasSubstr("version 2"));
  EXPECT_THAT(text_of("SO, it begins like a message"), HasSubstr("does not begin with a message of a sonar"));
  const auto missing = open_recording("/no/such/recording");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::missing_file);
  const auto folder = open_recording(std::filesystem::temp_directory_path());
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().kind, ErrorKind::bad_data);
}

TEST(Recording, AMessageThatNamesTheModelHasPriorityOverOthers) {
  const auto sender_in = [](const std::vector<RecordedMessage>& messages) {
    auto opened = open_bytes(recorded(Format::mcap, messages));
    const auto by = opened ? find_sender(*opened->reader) : std::nullopt;
    if (!by) throw std::runtime_error("no sender was found");
    EXPECT_EQ(read_all(*opened->reader).size(), messages.size()) << "the reader is not at the start";
    return by->sender;
  };
  const Sender named = sender_in(conversation());  // has pings before the status, which names the model
  EXPECT_EQ(named.model->profile, "oculus-m1200d");
  EXPECT_TRUE(named.names_model);
  EXPECT_EQ(named.serial, 7001u);

  std::vector<RecordedMessage> without_status = conversation();
  std::erase_if(without_status, [](const RecordedMessage& message) { return message.by == Carrier::datagram; });
  const Sender unnamed = sender_in(without_status);
  EXPECT_FALSE(unnamed.names_model);
  EXPECT_EQ(unnamed.serial, 7001u);
}

TEST(Recording, BytesBetweenMessagesAreKept) {
  std::vector<RecordedMessage> messages = conversation();
  const Bytes junk = bytes_of("S?SO what");
  messages.insert(messages.begin() + 3, {after_ms(120), Origin::device, Carrier::stream, junk});
  for (const Format format : {Format::raw_dump, Format::pcap, Format::mcap}) {
    auto opened = open_bytes(recorded(format, messages));
    ASSERT_TRUE(opened);
    EXPECT_EQ(device_stream(read_all(*opened->reader)), device_stream(messages)) << name_of(format);
    const auto damage = opened->reader->damage();
    ASSERT_TRUE(damage) << name_of(format);
    EXPECT_EQ(damage->kind, ErrorKind::bad_data);
    const std::vector<RecordedMessage> before(messages.begin(), messages.begin() + 3);
    const std::string dump_bytes = std::to_string(device_stream(before).size());
    // Three packets begin the connection; each message has a packet and an acknowledgement.
    const std::string place = format == Format::raw_dump ? "byte " + dump_bytes
                              : format == Format::pcap   ? "packet 10 of the connection with 127.0.0.1:40000"
                                                         : "the record at byte ";
    EXPECT_THAT(damage->text, HasSubstr("9 bytes from " + place)) << name_of(format);
    EXPECT_THAT(damage->text, HasSubstr(" on belong to no message"));
    EXPECT_THAT(damage->text, Not(HasSubstr("more such place")));
  }
}

TEST(Recording, EachRunOfJunkIsReportedOnce) {
  const auto junk = [](int ms, const char* text) {
    return RecordedMessage{after_ms(ms), Origin::device, Carrier::stream, bytes_of(text)};
  };
  const auto ping = [](int ms) { return RecordedMessage{after_ms(ms), Origin::device, Carrier::stream, ping_message(1)}; };
  for (const Format format : {Format::raw_dump, Format::pcap, Format::mcap}) {
    SCOPED_TRACE(name_of(format));
    const auto damage_of = [&](const std::vector<RecordedMessage>& messages) {
      auto opened = open_bytes(recorded(format, messages));
      if (!opened) return opened.error().text;
      EXPECT_EQ(device_stream(read_all(*opened->reader)), device_stream(messages));
      const auto first = opened->reader->damage();
      opened->reader->rewind();
      EXPECT_FALSE(opened->reader->damage());
      read_all(*opened->reader);
      EXPECT_EQ(opened->reader->damage().has_value(), first.has_value());
      return first ? first->text : std::string();
    };
    EXPECT_EQ(damage_of({ping(0), ping(1)}), "");
    EXPECT_THAT(damage_of({ping(0), junk(1, "what "), junk(2, "is this"), ping(3), junk(4, "?")}),
                AllOf(HasSubstr(" 12 bytes from "), HasSubstr("; 1 more such place")));
  }
}

/// Imitates a file that becomes shorter, or a disk that fails, during reading.
class ShrunkenSource final : public Source {
 public:
  ShrunkenSource(std::unique_ptr<Source> whole, std::uint64_t readable) : whole_(std::move(whole)), readable_(readable) {}
  const std::string& name() const override { return whole_->name(); }
  std::uint64_t size() const override { return whole_->size(); }
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> into) override {
    if (offset >= readable_) return 0;
    return whole_->read_at(offset, into.first(std::min<std::size_t>(into.size(), readable_ - offset)));
  }

 private:
  std::unique_ptr<Source> whole_;
  std::uint64_t readable_;
};

TEST(Recording, JunkBeforeAReadErrorIsReported) {
  Bytes file = ping_message(1);
  const std::string after_one = std::to_string(file.size());
  const Bytes junk = bytes_of("what is this? SO");  // a message may begin with the last two bytes
  file.insert(file.end(), junk.begin(), junk.end());
  const std::size_t readable = file.size();
  file.resize(file.size() + 100);
  auto opened = open_recording(std::make_unique<ShrunkenSource>(source_from("a file", file), readable), "");
  ASSERT_TRUE(opened);
  EXPECT_EQ(device_stream(read_all(*opened->reader)).size(), readable - 2);
  ASSERT_TRUE(opened->reader->damage());
  EXPECT_EQ(opened->reader->damage()->text,
            "a file: 14 bytes from byte " + after_one + " on belong to no message; 1 more such place");
}

TEST(Recording, JunkInARawDumpIsCountedWithItsPlace) {
  const Bytes ping = ping_message(1);
  const auto damage_of = [](std::initializer_list<Bytes> parts) {
    Bytes file;
    for (const Bytes& part : parts) file.insert(file.end(), part.begin(), part.end());
    auto opened = open_bytes(file);
    if (!opened) return opened.error().text;
    EXPECT_EQ(device_stream(read_all(*opened->reader)).size(), file.size());
    const auto first = opened->reader->damage();
    opened->reader->rewind();
    EXPECT_FALSE(opened->reader->damage());
    read_all(*opened->reader);
    EXPECT_EQ(opened->reader->damage().has_value(), first.has_value());
    return first ? first->text : std::string();
  };
  const std::string after_one = std::to_string(ping.size());
  EXPECT_EQ(damage_of({ping, ping}), "");
  // The second piece begins like a message, but with an unknown type. Both pieces are reported as one place.
  EXPECT_THAT(damage_of({ping, bytes_of("S"), bytes_of("SOSOSOSOSOSOSOSOSOSO"), ping}),
              HasSubstr("21 bytes from byte " + after_one + " on belong to no message"));
  EXPECT_THAT(damage_of({ping, bytes_of("x")}), HasSubstr("1 byte from byte " + after_one + " on belong to no message"));
  EXPECT_THAT(damage_of({ping, bytes_of("xy"), ping, bytes_of("z"), ping}),
              HasSubstr("2 bytes from byte " + after_one + " on belong to no message; 1 more such place"));
  EXPECT_THAT(damage_of({bytes_of("no message"), ping}), HasSubstr("is not a recording"));
}

TEST(Recording, ADamagedPlaceLosesNoOtherMessage) {
  for (const Format format : {Format::oculus_log, Format::mcap}) {
    std::vector<RecordedMessage> messages;
    for (std::uint32_t i = 0; i < 9; ++i)
      messages.push_back({after_ms(1500 * static_cast<int>(i)), Origin::device, Carrier::stream, ping_message(i)});
    Bytes file = recorded(format, messages);
    file[file.size() / 2] ^= std::byte{0xFF};
    for (std::size_t i = 0; format == Format::oculus_log && i < 4; ++i) file[48 + i] ^= std::byte{0x55};
    auto opened = open_bytes(file);
    ASSERT_TRUE(opened);
    const std::vector<RecordedMessage> found = read_all(*opened->reader);
    EXPECT_GE(found.size(), 6u) << name_of(format);
    EXPECT_LT(found.size(), 10u);
    EXPECT_EQ(found.back().bytes, messages.back().bytes);
    ASSERT_TRUE(opened->reader->damage());
    EXPECT_THAT(opened->reader->damage()->text, HasSubstr("a file: "));
    EXPECT_THAT(opened->reader->damage()->text, HasSubstr("at byte "));
  }
}

/// Writes and reads the bytes of a real device in every format (SONARD_CAPTURES).
TEST(Recording, KeepsTheCapturedPings) {
  const char* folder = std::getenv("SONARD_CAPTURES");
  if (folder == nullptr) GTEST_SKIP() << "SONARD_CAPTURES names no folder of recordings";
  std::filesystem::path file = std::filesystem::path(folder) / "three_pings_8bit.raw";
  if (!std::filesystem::exists(file)) file = std::filesystem::path(folder) / "oculus/three_pings_8bit.raw";
  auto dump = open_recording(file);
  if (!dump) GTEST_SKIP() << dump.error().text;
  std::vector<RecordedMessage> messages = read_all(*dump->reader);
  ASSERT_EQ(messages.size(), 3u);
  EXPECT_FALSE(dump->reader->damage());
  EXPECT_EQ(device_stream(messages).size(), std::filesystem::file_size(file));
  for (std::size_t i = 0; i < 3; ++i) messages[i].at = after_ms(62 * static_cast<int>(i));
  for (const Format format : all_formats) {
    auto opened = open_bytes(recorded(format, messages));
    ASSERT_TRUE(opened);
    expect_same(read_all(*opened->reader), messages, opened->reader->knows_times());
  }
}

}  // namespace
}  // namespace sonar::recording::tests
