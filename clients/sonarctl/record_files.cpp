#include "clients/sonarctl/record.hpp"

#include <algorithm>
#include <cstdio>

#include "protocol/recorded/message_splitter.hpp"

namespace sonar::clients {

namespace {

/// Converts a picture to codes of 8 or 16 bits.
recording::Samples samples_of(const PolarImage& image, unsigned bits) {
  const auto codes = std::make_shared<wire::Bytes>();
  const std::uint32_t most = bits == 8 ? 0xFF : 0xFFFF;
  for (const float sample : image.samples) {
    const auto code = std::min(static_cast<std::uint32_t>(std::max(0.0f, sample)), most);
    codes->push_back(static_cast<std::byte>(code & 0xFF));
    if (bits != 8) codes->push_back(static_cast<std::byte>(code >> 8));
  }
  return {image.beams, image.rows, bits == 8 ? 8 : 16, codes};
}

}  // namespace

Result<RecordFiles> RecordFiles::create(const RecordOptions& options, const Make& make,
                                        const recording::PcapConversation& conversation, const std::string& sonar,
                                        const std::string& profile) {
  RecordFiles files;
  files.make_ = &make;
  Result<void> made;
  const auto& kinds = make.codec.files;
  for (const auto& [ending, path] : options.files) {
    if (std::none_of(kinds.begin(), kinds.end(), [&wanted = ending](const auto& kind) { return kind.ending == wanted; }))
      return failure(ErrorKind::usage, path.string() + ": such files do not hold the messages of " + std::string(make.title) +
                                           ": --mcap and --pcap hold those of every sonar");
  }
  // In one file, the bytes of several connections could not be distinguished.
  const bool has_raw_dumps =
      make.codec.framing != nullptr ||
      std::any_of(kinds.begin(), kinds.end(), [](const recording::FileKind& kind) { return kind.is_raw_dump; });
  if (!options.raw.empty() && (make.has_several_streams() || !has_raw_dumps))
    return failure(ErrorKind::usage, options.raw.string() + ": a raw dump of " + std::string(make.title) +
                                         " cannot be read back: --mcap and --pcap hold its messages");
  const auto add = [&](const std::filesystem::path& path, const auto& writer_of) {
    if (path.empty() || !made) return;
    auto sink = recording::create_sink(path);
    if (!sink) {
      made = tl::unexpected(sink.error());
      return;
    }
    files.writers_.push_back(writer_of(std::move(*sink)));
    files.paths_.push_back(path);
  };
  add(options.pcap, [&](auto sink) { return recording::write_pcap(std::move(sink), conversation); });
  for (const recording::FileKind& kind : make.codec.files)
    if (const auto named = options.files.find(kind.ending); named != options.files.end()) add(named->second, kind.write);
  add(options.raw, [&make](auto sink) {
    const bool by_tcp = make.device->pings_by() != protocol::PingsBy::datagrams;
    return recording::write_raw_dump(std::move(sink), by_tcp ? recording::Carrier::stream : recording::Carrier::datagram);
  });
  add(options.mcap, [&](auto sink) {
    auto session = std::make_unique<recording::McapSession>(std::move(sink), sonar, make, profile);
    files.mcap_ = session.get();
    return session;
  });
  if (!made) return tl::unexpected(made.error());
  return files;
}

Result<void> RecordFiles::write(const recording::RecordedMessage& message) {
  for (const auto& writer : writers_)
    if (Result<void> written = writer->write(message); !written) return written;
  ++messages_;
  bytes_ += message.bytes.size();
  return {};
}

Result<void> RecordFiles::write_ping(Time at, const HostPing& ping) {
  ++pings_;
  // The session itself makes images from messages with samples. For scans nothing is written, because each line would add a
  // whole picture.
  if (mcap_ == nullptr || make_->codec.samples != nullptr || make_->scans) return {};
  const Result<PolarImage> image = ping.picture();
  return image ? mcap_->write_image(at, samples_of(*image, ping.facts.bits)) : Result<void>{};  // some pings make no picture
}

Result<void> RecordFiles::write_pose(Time at, Time of, const Pose& sonar_in_world) {
  return mcap_ == nullptr ? Result<void>{} : mcap_->write_pose(at, of, sonar_in_world);
}

Result<void> RecordFiles::close() {
  Result<void> first;
  for (const auto& writer : writers_)
    if (Result<void> closed = writer->close(); !closed && first) first = closed;
  return first;
}

std::string RecordFiles::sizes() const {
  std::string text;
  for (const auto& path : paths_) {
    std::error_code ec;
    const auto size = std::filesystem::file_size(path, ec);
    char figure[32];
    std::snprintf(figure, sizeof figure, " %.1f MB", ec ? 0.0 : static_cast<double>(size) / 1e6);
    text += (text.empty() ? "" : ", ") + path.string() + figure;
  }
  return text;
}

}  // namespace sonar::clients
