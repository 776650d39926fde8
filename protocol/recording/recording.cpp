#include "protocol/recording/recording.hpp"

#include <algorithm>

#include "core/text/ipv4.hpp"
#include "protocol/recording/aris_file.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/oculus_log.hpp"
#include "protocol/recording/pcap/pcap.hpp"
#include "protocol/recording/ping_log.hpp"
#include "protocol/recording/raw_dump.hpp"
#include "protocol/recording/sonar_file.hpp"

namespace sonar::recording {
namespace {

bool begins_with(BytesView front, std::initializer_list<unsigned> bytes) {
  return front.size() >= bytes.size() && std::equal(bytes.begin(), bytes.end(), front.begin(),
                                                    [](unsigned a, std::byte b) { return a == std::to_integer<unsigned>(b); });
}

std::optional<Format> format_of(BytesView front) {
  if (begins_with(front, {0x44, 0x33, 0x22, 0x11})) return Format::oculus_log;
  if (begins_with(front, {0x89, 'M', 'C', 'A', 'P'})) return Format::mcap;
  if (begins_with(front, {'D', 'D', 'F', 5})) return Format::aris_file;
  if (begins_with(front, {'B', 'R'})) return Format::ping_log;
  if (begins_with(front, {'R', 'I', 'P', '1'}) || begins_with(front, {'R', 'I', 'P', '2'})) return Format::sonar_file;
  // micro- and nanoseconds in either byte order, pcapng
  if (begins_with(front, {0xD4, 0xC3, 0xB2, 0xA1}) || begins_with(front, {0xA1, 0xB2, 0xC3, 0xD4}) ||
      begins_with(front, {0x4D, 0x3C, 0xB2, 0xA1}) || begins_with(front, {0xA1, 0xB2, 0x3C, 0x4D}) ||
      begins_with(front, {0x0A, 0x0D, 0x0D, 0x0A}))
    return Format::pcap;
  if (begins_with(front, {0x53, 0x4F})) return Format::raw_dump;
  return std::nullopt;
}

/// The address that selects a sonar of a capture; nullopt selects the only one.
Result<std::optional<std::uint32_t>> address_from(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto ip = text::parse_ipv4(text);
  if (!ip) return failure(ErrorKind::usage, "\"" + text + "\" is not an IPv4 address; a capture names its sonars by address");
  return text::number_from_ipv4(*ip);
}

}  // namespace

const char* name_of(Format format) {
  switch (format) {
    case Format::oculus_log:
      return ".oculus log";
    case Format::raw_dump:
      return "raw dump";
    case Format::pcap:
      return "capture";
    case Format::mcap:
      return "MCAP";
    case Format::aris_file:
      return ".aris file";
    case Format::ping_log:
      return "ping protocol log";
    case Format::sonar_file:
      return ".sonar file";
  }
  return "";
}

Result<Recording> open_recording(std::unique_ptr<Source> source, const std::string& sonar) {
  std::array<std::byte, 16> front{};
  const std::size_t there = source->read_at(0, front);
  const BytesView view = BytesView(front).first(there);
  const auto format = format_of(view);
  if (!format) {
    const bool sqlite = begins_with(view, {'S', 'Q', 'L', 'i', 't', 'e', ' ', 'f'});
    const std::string why =
        there == 0 ? " is empty"
        : sqlite   ? " is an SQLite database: .oculus files of version 2 are not read, only version 1"
                   : " is not a recording: expected an .oculus log, a raw dump, pcap, pcapng, MCAP, .aris, .sonar or "
                     ".svlog";
    return failure(ErrorKind::bad_data, source->name() + why);
  }
  if (!sonar.empty() && *format != Format::pcap && *format != Format::mcap)
    return failure(ErrorKind::usage,
                   source->name() + " is a" + (*format == Format::oculus_log || *format == Format::aris_file ? "n " : " ") +
                       name_of(*format) + ", which holds one sonar without a name: leave out the choice of one");
  Result<std::unique_ptr<RecordingReader>> reader;
  if (*format == Format::pcap) {
    const auto device = address_from(sonar);
    if (!device) return tl::unexpected(device.error());
    reader = read_pcap(std::move(source), {*device});
  } else if (*format == Format::mcap) {
    reader = read_mcap(std::move(source), sonar);
  } else if (*format == Format::aris_file) {
    reader = read_aris_file(std::move(source));
  } else if (*format == Format::ping_log) {
    reader = read_ping_log(std::move(source));
  } else if (*format == Format::sonar_file) {
    reader = read_sonar_file(std::move(source));
  } else {
    reader = *format == Format::oculus_log ? read_oculus_log(std::move(source)) : read_raw_dump(std::move(source));
  }
  if (!reader) return tl::unexpected(reader.error());
  return Recording{*format, std::move(*reader)};
}

Result<Recording> open_recording(const std::filesystem::path& file, const std::string& sonar) {
  auto source = open_source(file);
  if (!source) return tl::unexpected(source.error());
  return open_recording(std::move(*source), sonar);
}

}  // namespace sonar::recording
