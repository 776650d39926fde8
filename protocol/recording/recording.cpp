#include "protocol/recording/recording.hpp"

#include <array>

#include "core/text/ipv4.hpp"
#include "protocol/recorded/raw_dump.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"

namespace sonar::recording {
namespace {

constexpr std::uint64_t most_searched_bytes = 64u << 20;

bool is_mcap(BytesView front) { return begins_with(front, {0x89, 'M', 'C', 'A', 'P'}); }
/// Magic numbers of pcap, with micro- or nanoseconds in either byte order, and of pcapng.
bool is_capture(BytesView front) {
  return begins_with(front, {0xD4, 0xC3, 0xB2, 0xA1}) || begins_with(front, {0xA1, 0xB2, 0xC3, 0xD4}) ||
         begins_with(front, {0x4D, 0x3C, 0xB2, 0xA1}) || begins_with(front, {0xA1, 0xB2, 0x3C, 0x4D}) ||
         begins_with(front, {0x0A, 0x0D, 0x0D, 0x0A});
}

/// The address that selects a sonar of a capture; nullopt selects the only one.
Result<std::optional<std::uint32_t>> address_from(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto ip = text::parse_ipv4(text);
  if (!ip) return failure(ErrorKind::usage, "\"" + text + "\" is not an IPv4 address; a capture names its sonars by address");
  return text::number_from_ipv4(*ip);
}

using OpenedReader = Result<std::unique_ptr<RecordingReader>>;

Result<Recording> opened(std::string_view format, OpenedReader reader) {
  if (!reader) return tl::unexpected(reader.error());
  return Recording{format, std::move(*reader)};
}

/// Opens a file that holds one sonar: a kind of file of some make, else a raw dump. Kinds come first, because the files of some
/// makes begin like messages of their stream.
Result<Recording> open_file(std::unique_ptr<Source> source, BytesView front, const std::string& sonar) {
  const auto complaint = [&](std::string_view format) {
    const bool vowel = std::string_view("aeio").find(format[format[0] == '.' ? 1 : 0]) != std::string_view::npos;
    return failure(ErrorKind::usage, source->name() + (vowel ? " is an " : " is a ") + std::string(format) +
                                         ", which holds one sonar without a name: leave out the choice of one");
  };
  for (const protocol::Make& make : protocol::makes())
    for (const FileKind& kind : make.codec.files) {
      if (!kind.begins(front)) continue;
      if (!sonar.empty()) return complaint(kind.name);
      return opened(kind.name, kind.read(std::move(source)));
    }
  for (const protocol::Make& make : protocol::makes()) {
    const Framing* const framing = make.codec.framing;
    if (framing == nullptr || !begins_with(front, {framing->magic[0], framing->magic[1]})) continue;
    if (!sonar.empty()) return complaint("raw dump");
    return opened("raw dump", read_raw_dump(std::move(source), *framing));
  }
  return failure(ErrorKind::bad_data,
                 source->name() + (front.empty() ? " is empty" : " is not a recording: expected pcapng, " + file_endings()));
}

}  // namespace

std::string file_endings() {
  std::string endings = ".pcap, .mcap, .raw";
  for (const protocol::Make& make : protocol::makes())
    for (const FileKind& kind : make.codec.files)
      if (endings.find(kind.ending) == std::string::npos) endings.append(", ").append(kind.ending);
  return endings;
}

// The kind of a file is known by its first bytes, never by its name.
Result<Recording> open_recording(std::unique_ptr<Source> source, const std::string& sonar) {
  std::array<std::byte, 16> front{};
  const std::size_t there = source->read_at(0, front);
  const BytesView view = BytesView(front).first(there);
  if (is_mcap(view)) return opened("MCAP", read_mcap(std::move(source), sonar));
  if (!is_capture(view)) return open_file(std::move(source), view, sonar);
  const auto device = address_from(sonar);
  if (!device) return tl::unexpected(device.error());
  return opened("capture", read_pcap(std::move(source), {*device}));
}

Result<Recording> open_recording(const std::filesystem::path& file, const std::string& sonar) {
  auto source = open_source(file);
  if (!source) return tl::unexpected(source.error());
  return open_recording(std::move(*source), sonar);
}

std::optional<SentBy> find_sender(RecordingReader& reader) {
  std::optional<SentBy> found;
  const auto take_stated_model = [&reader](SentBy& by) {
    const std::string stated = reader.profile();
    if (stated.empty()) return;
    for (const auto& model : by.make->device->models())
      if (model->profile == stated) by.sender.model = model, by.sender.names_model = true;
  };
  // A later message is better only if it names the model of the same sonar.
  const auto is_better = [&found](const SentBy& by) {
    return !found || (by.sender.names_model && by.make == found->make && by.sender.serial == found->sender.serial);
  };
  for (std::uint64_t searched = 0; (!found || !found->sender.names_model) && searched <= most_searched_bytes;) {
    const auto message = reader.next();
    if (!message) break;
    searched += message->bytes.size();
    if (auto by = sender_of(*message); by && is_better(*by)) found = std::move(by);
    if (found && !found->sender.names_model) take_stated_model(*found);
  }
  reader.rewind();
  return found;
}

}  // namespace sonar::recording
