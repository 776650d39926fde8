#include "protocol/recording/recording.hpp"

#include <array>
#include <utility>
#include <variant>

#include "core/text/ipv4.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"

namespace sonar::recording {
namespace {

constexpr std::uint64_t most_searched_bytes = 64u << 20;

bool is_mcap(BytesView front) { return begins_with(front, {0x89, 'M', 'C', 'A', 'P'}); }
/// True for the magic numbers of pcap, with micro- or nanoseconds and any byte order, and of pcapng.
bool is_capture(BytesView front) {
  return begins_with(front, {0xD4, 0xC3, 0xB2, 0xA1}) || begins_with(front, {0xA1, 0xB2, 0xC3, 0xD4}) ||
         begins_with(front, {0x4D, 0x3C, 0xB2, 0xA1}) || begins_with(front, {0xA1, 0xB2, 0x3C, 0x4D}) ||
         begins_with(front, {0x0A, 0x0D, 0x0D, 0x0A});
}

/// Returns the address that selects a sonar of a capture; nullopt if the text is empty.
Result<std::optional<std::uint32_t>> address_from(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto ip = text::parse_ipv4(text);
  if (!ip) return failure(ErrorKind::usage, "\"" + text + "\" is not an IPv4 address; captures need the address of a sonar");
  return text::number_from_ipv4(*ip);
}

using OpenedReader = Result<std::unique_ptr<RecordingReader>>;

Result<Recording> opened(std::string_view format, OpenedReader reader) {
  if (!reader) return tl::unexpected(reader.error());
  return Recording{format, std::move(*reader)};
}

/// Opens a file that holds one sonar: in a file format of some make, else a raw dump. The formats of makes are tried first,
/// because some of their files begin with the same bytes as a raw dump.
Result<Recording> open_file(std::unique_ptr<Source> source, BytesView front, const std::string& sonar) {
  const auto selection_error = [&](std::string_view format) {
    const bool vowel = std::string_view("aeio").find(format[format[0] == '.' ? 1 : 0]) != std::string_view::npos;
    return failure(ErrorKind::usage, source->name() + (vowel ? " is an " : " is a ") + std::string(format) +
                                         ", which holds one sonar without a name: do not select a sonar");
  };
  for (const protocol::Make& make : protocol::makes())
    for (const FileKind& kind : make.codec.files) {
      if (!kind.begins(front)) continue;
      if (!sonar.empty()) return selection_error(kind.name);
      return opened(kind.name, kind.read(std::move(source)));
    }
  for (const protocol::Make& make : protocol::makes()) {
    const Framing* const framing = make.codec.framing;
    if (framing == nullptr || !begins_with(front, {framing->magic[0], framing->magic[1]})) continue;
    if (!sonar.empty()) return selection_error("raw dump");
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

// The first bytes of a file determine its format; its name has no influence.
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
  // A later message is better only if it states the model of the same sonar.
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

std::vector<RecordedPing> decode_next(protocol::Host& host, const protocol::Make& make, const RecordedMessage* message) {
  std::vector<RecordedPing> pings;
  const auto take = [&](protocol::HostActions actions, Time at) {
    for (protocol::HostAction& action : actions)
      if (auto* const ping = std::get_if<protocol::HostPing>(&action)) pings.push_back({at, std::move(*ping)});
  };
  if (const auto tick = host.next_tick(); tick && (message == nullptr || *tick <= message->at)) {
    const Time at = message == nullptr ? *tick : message->at;
    take(host.on_tick(at), at);
  }
  if (message == nullptr || message->from != Origin::device) return pings;
  if (const auto port = host_port(make, message->by)) take(host.on_bytes(*port, message->bytes, message->at), message->at);
  return pings;
}

Result<RecordedPings> RecordedPings::open(std::unique_ptr<RecordingReader> reader) {
  auto by = find_sender(*reader);
  if (!by) return failure(ErrorKind::bad_data, "holds no ping of a known sonar");
  RecordedPings pings(std::move(reader), std::move(*by));
  if (const Result<void> made = pings.make_host(); !made) return tl::unexpected(made.error());
  return pings;
}

/// The host decodes messages of a recording as it decodes those of a sonar. `as_it_is`: there is no sonar to send settings to. A
/// new host accepts any number for the next ping, and begins a new picture of a scan.
Result<void> RecordedPings::make_host() {
  protocol::Wanted wanted;
  wanted.as_it_is = true;
  auto host = by_.make->host(wanted);
  if (!host) return tl::unexpected(host.error());
  host_ = *std::move(host);
  return {};
}

std::optional<RecordedPing> RecordedPings::next() {
  while (decoded_.empty()) {
    const auto message = reader_->next();
    for (RecordedPing& ping : decode_next(*host_, *by_.make, message ? &*message : nullptr)) decoded_.push_back(std::move(ping));
    if (!message && decoded_.empty()) return std::nullopt;
  }
  RecordedPing first = std::move(decoded_.front());
  decoded_.pop_front();
  return first;
}

void RecordedPings::rewind() {
  reader_->rewind();
  decoded_.clear();
  static_cast<void>(make_host());  // cannot fail, because open() has called it before
}

}  // namespace sonar::recording
