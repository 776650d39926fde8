#include "protocol/aris/aris_file.hpp"

#include <deque>

#include "protocol/aris/encode_frame.hpp"

namespace sonar::recording {
namespace {

constexpr std::uint32_t most_beams = 128;

/// The first fields of the file header, from the vendor's aris-file-sdk. Programs use the numbers of beams and samples of this
/// header, not those of the frames.
struct FileHeader {
  std::uint32_t version = aris::file_version, frames = 0;
  std::array<std::uint32_t, 2> reserved0{};
  std::uint32_t beams = 0, reserved1 = 0, samples = 0;
  std::array<std::uint32_t, 4> reserved2{};
  std::uint32_t serial = 0;
};
constexpr void fields(auto& visit, wire::Like<FileHeader> auto& m) {
  visit("Version", m.version);
  visit("FrameCount", m.frames);
  visit("reserved0", m.reserved0);
  visit("NumRawBeams", m.beams);
  visit("reserved1", m.reserved1);
  visit("SamplesPerChannel", m.samples);
  visit("reserved2", m.reserved2);
  visit("SerialNumber", m.serial);
}

/// Reads frame by frame. All frames have the size that the file header states, so a damaged frame can be skipped.
class ArisFileReader final : public RecordingReader {
 public:
  ArisFileReader(std::unique_ptr<Source> source, const FileHeader& header)
      : source_(std::move(source)),
        scan_(*source_, aris::padded_header_size),
        header_(header),
        picture_size_(std::size_t{header.beams} * header.samples) {}

  std::optional<RecordedMessage> next() override {
    while (parts_.empty())
      if (!read_frame()) return std::nullopt;
    RecordedMessage message{at_, Origin::device, Carrier::datagram, std::move(parts_.front())};
    parts_.pop_front();
    return message;
  }
  std::optional<Error> damage() const override { return damages_.error(source_->name()); }
  void rewind() override {
    scan_.seek(aris::padded_header_size);
    places_ = frames_ = 0;
    ended_ = false;
    damages_.clear();
    parts_.clear();
  }

 private:
  /// Reads a frame. Returns false at the end of the file.
  bool read_frame() {
    const std::size_t record = aris::padded_header_size + picture_size_;
    if (ended_) return false;
    const std::uint64_t at = scan_.position(), left = scan_.left();
    const BytesView bytes = left < record ? BytesView{} : scan_.read(record);
    if (bytes.size() != record) {
      ended_ = true;
      const std::string frame = "frame " + std::to_string(places_ + 1);
      if (left >= record)
        damages_.add("cannot be read from byte " + std::to_string(at) + " on");
      else if (left > 0)
        damages_.add("the file ends at byte " + std::to_string(source_->size()) + " within " + frame + ": only " +
                     std::to_string(left) + " of its " + std::to_string(record) + " bytes are there");
      else if (places_ < header_.frames)
        damages_.add("the file's header announces " + std::to_string(header_.frames) + " frames, and the file holds " +
                     std::to_string(places_));
      return false;
    }
    ++places_;
    aris::FrameHeader header;
    wire::Reader reader(bytes);
    fields(reader, header);
    if (header.version != aris::file_version || header.samples_per_beam != header_.samples) {
      damages_.add("frame " + std::to_string(places_) + " at byte " + std::to_string(at) +
                   " is damaged: its version or number of samples is not the file's");
      return true;
    }
    // Frames are converted to datagrams, so that the host for live frames can read files too.
    at_ = Time(std::chrono::microseconds(header.frame_time_us % longest_time_us));
    for (Bytes& part : aris::parts_of(++frames_, bytes.first(aris::header_size), bytes.subspan(aris::padded_header_size)))
      parts_.push_back(std::move(part));
    return true;
  }

  static constexpr std::uint64_t longest_time_us = std::uint64_t{1} << 52;  // 142 years; in nanoseconds this fits into 64 bits
  std::unique_ptr<Source> source_;
  Scan scan_;
  FileHeader header_;
  std::size_t picture_size_;
  std::uint64_t places_ = 0;
  std::int32_t frames_ = 0;
  bool ended_ = false;
  Time at_{};
  std::deque<Bytes> parts_;
  Damages damages_;
};

/// Collects the datagrams of frames and writes whole frames in the order of the picture. The sizes in the file header are those
/// of the first frame.
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
                     "the settings were changed, and frames now have another size; an .aris file holds frames of one size");
    frame->header.frame_index = header_.frames;
    frame->header.reordered = 1;  // FrameAssembler has put the samples into the order of the picture
    const std::size_t at = record.size();
    wire::append(record, frame->header);
    record.resize(at + aris::padded_header_size);
    record.insert(record.end(), frame->picture.begin(), frame->picture.end());
    if (auto written = sink_->append(record); !written) return written;
    ++header_.frames;
    return sink_->overwrite(0, wire::bytes_of(header_));  // after each frame, so that the count is right if the program is killed
  }

  Result<void> close() override { return sink_->close(); }

 private:
  std::unique_ptr<Sink> sink_;
  aris::FrameAssembler assembler_;
  FileHeader header_;
};

}  // namespace

Result<std::unique_ptr<RecordingReader>> read_aris_file(std::unique_ptr<Source> source) {
  Scan scan(*source);
  const BytesView front = scan.read(aris::padded_header_size);
  if (front.size() < aris::padded_header_size)
    return failure(ErrorKind::bad_data, source->name() + " ends at byte " + std::to_string(front.size()) + ", within its header");
  FileHeader header;
  wire::Reader reader(front);
  fields(reader, header);
  if (header.beams == 0 || header.beams > most_beams || header.samples == 0 || header.samples > aris::most_samples)
    return failure(ErrorKind::bad_data, source->name() + " announces frames of " + std::to_string(header.beams) + " beams and " +
                                            std::to_string(header.samples) + " samples, which no ARIS sends");
  return std::make_unique<ArisFileReader>(std::move(source), header);
}

std::unique_ptr<RecordingWriter> write_aris_file(std::unique_ptr<Sink> sink) {
  return std::make_unique<ArisFileWriter>(std::move(sink));
}

}  // namespace sonar::recording
