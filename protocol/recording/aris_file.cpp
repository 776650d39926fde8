#include "protocol/recording/aris_file.hpp"

#include "protocol/aris/encode_frame.hpp"

namespace sonar::recording {
namespace {

struct FileHeader {
  std::uint32_t version = aris::file_version, frames = 0;
  std::array<std::uint32_t, 2> reserved0{};
  std::uint32_t beams = 0, reserved1 = 0, samples = 0;
  std::array<std::uint32_t, 4> reserved2{};
  std::uint32_t serial = 0;
};
template <class V, wire::Like<FileHeader> M>
constexpr void fields(V& visit, M& m) {
  visit("Version", m.version);
  visit("FrameCount", m.frames);
  visit("reserved0", m.reserved0);
  visit("NumRawBeams", m.beams);
  visit("reserved1", m.reserved1);
  visit("SamplesPerChannel", m.samples);
  visit("reserved2", m.reserved2);
  visit("SerialNumber", m.serial);
}

class ArisFileWriter final : public RecordingWriter {
 public:
  explicit ArisFileWriter(std::unique_ptr<Sink> sink) : sink_(std::move(sink)) {}

  Result<void> write(const RecordedMessage& message) override {
    if (message.from != Origin::device || message.by != Carrier::datagram) return {};
    auto frame = assembler_.add(message.bytes);
    if (!frame) return {};
    Bytes record;
    if (header_.frames == 0) {
      header_.beams = static_cast<std::uint32_t>(frame->beams);
      header_.samples = static_cast<std::uint32_t>(frame->samples);
      header_.serial = frame->header.serial;
      record = wire::bytes_of(header_);
      record.resize(aris::padded_header_size);
    }
    if (frame->beams != header_.beams || frame->samples != header_.samples)
      return failure(ErrorKind::bad_data,
                     "frames of another shape follow, which an .aris file cannot hold: the settings have changed");
    frame->header.frame_index = header_.frames;
    frame->header.reordered = 1;
    const std::size_t at = record.size();
    wire::append(record, frame->header);
    record.resize(at + aris::padded_header_size);
    record.insert(record.end(), frame->picture.begin(), frame->picture.end());
    if (auto written = sink_->append(record); !written) return written;
    ++header_.frames;
    return sink_->overwrite(0, wire::bytes_of(header_));  // a file that is cut off says what it holds
  }

  Result<void> close() override { return sink_->close(); }

 private:
  std::unique_ptr<Sink> sink_;
  aris::FrameAssembler assembler_;
  FileHeader header_;
};

}  // namespace

std::unique_ptr<RecordingWriter> write_aris_file(std::unique_ptr<Sink> sink) {
  return std::make_unique<ArisFileWriter>(std::move(sink));
}

}  // namespace sonar::recording
