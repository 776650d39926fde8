#include "daemon/server/view/played_recording.hpp"

#include <stdexcept>
#include <utility>

#include "daemon/server/recording/recording_file.hpp"

namespace sonar {
namespace {

class WatchedSource final : public recording::Source {
 public:
  WatchedSource(std::unique_ptr<recording::Source> file, ViewerLeft left) : file_(std::move(file)), left_(std::move(left)) {}
  const std::string& name() const override { return file_->name(); }
  std::uint64_t size() const override { return file_->size(); }
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> into) override {
    if (*left_) throw std::runtime_error("its viewer has left");
    return file_->read_at(offset, into);
  }

 private:
  std::unique_ptr<recording::Source> file_;
  ViewerLeft left_;
};

}  // namespace

Result<recording::RecordedPings> open_pings(const PlayedRecording& wanted, const ViewerLeft& left) {
  if (!wanted.within.empty() && !RecordingFile::is_inside(wanted.within, wanted.file))
    return failure(ErrorKind::missing_file,
                   wanted.file.filename().string() +
                       ": is a symbolic link out of the folder of recordings, or to nothing; put a copy there");
  auto source = recording::open_source(wanted.file);
  if (!source) return tl::make_unexpected(source.error());
  auto opened = recording::open_recording(std::make_unique<WatchedSource>(*std::move(source), left), wanted.sonar);
  if (!opened) return tl::make_unexpected(opened.error());
  auto pings = recording::RecordedPings::open(std::move(opened->reader));
  if (!pings) return failure(pings.error().kind, wanted.file.filename().string() + " " + pings.error().text);
  return pings;
}

}  // namespace sonar
