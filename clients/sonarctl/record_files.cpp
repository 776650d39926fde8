#include "clients/sonarctl/record_files.hpp"

#include <cstdio>

#include "protocol/oculus/framer.hpp"
#include "protocol/recording/oculus_log.hpp"
#include "protocol/recording/raw_dump.hpp"

namespace sonar::clients {

Result<RecordFiles> RecordFiles::create(const RecordOptions& options, const recording::PcapConversation& conversation,
                                        const std::string& sonar) {
  RecordFiles files;
  Result<void> made;
  const auto add = [&](const std::filesystem::path& path, const auto& make) {
    if (path.empty() || !made) return;
    auto sink = recording::create_sink(path);
    if (!sink) {
      made = tl::unexpected(sink.error());
      return;
    }
    files.writers_.push_back(make(std::move(*sink)));
    files.paths_.push_back(path);
  };
  add(options.pcap, [&](auto sink) { return recording::write_pcap(std::move(sink), conversation); });
  add(options.oculus, [](auto sink) { return recording::write_oculus_log(std::move(sink)); });
  add(options.raw, [](auto sink) { return recording::write_raw_dump(std::move(sink)); });
  add(options.mcap, [&](auto sink) {
    auto session = std::make_unique<recording::McapSession>(std::move(sink), sonar);
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
  const bool ping = message.from == recording::Origin::device && message.bytes.size() >= oculus::header_size &&
                    oculus::header_of(message.bytes).type == oculus::MessageType::ping_result;
  pings_ += ping ? 1 : 0;
  return {};
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
