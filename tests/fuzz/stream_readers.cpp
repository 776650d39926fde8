// The drivers of the fuzzed conversations: our decoder for Oculus, and the decoder of the BlueView libraries.
#include <cstring>

#include "clients/bvtsdk/core/description.hpp"
#include "clients/bvtsdk/core/frame.hpp"
#include "clients/bvtsdk/core/polar_ping.hpp"
#include "tests/fuzz/byte_script.hpp"
#include "tests/fuzz/sonar_clients.hpp"

namespace sonar::fuzz {
namespace {

class OculusReader final : public StreamReader {
 public:
  void read(protocol::BytesView bytes) override {
    decoder_.append(bytes);
    while (const auto received = decoder_.next()) {
      require(!std::holds_alternative<oculus::OtherMessage>(*received));
      const auto* ping = std::get_if<oculus::DecodedPing>(&*received);
      if (ping == nullptr) continue;
      require(ping->has_image && ping->rows() >= 1 && ping->beams() >= 1 && ping->head.fixed.ping_id > last_);
      last_ = ping->head.fixed.ping_id;
    }
    require(decoder_.skipped_bytes() == 0);
  }
  bool at_a_message_end() const override { return decoder_.buffered_bytes() == 0; }

 private:
  oculus::Decoder decoder_;
  std::uint32_t last_ = 0;
};

class BlueViewReader final : public StreamReader {
 public:
  void read(protocol::BytesView bytes) override {
    const std::size_t before = buffer_.size();
    buffer_.resize(before + bytes.size());
    if (!bytes.empty()) std::memcpy(buffer_.data() + before, bytes.data(), bytes.size());
    std::size_t at = 0;
    bvt::FrameHeader header;
    while (buffer_.size() - at >= bvt::frame_header_size) {
      require(bvt::read_header({buffer_.data() + at, buffer_.size() - at}, header));
      const std::size_t whole = bvt::frame_header_size + header.payload_size;
      if (buffer_.size() - at < whole) break;
      take(header, {buffer_.data() + at + bvt::frame_header_size, header.payload_size});
      at += whole;
    }
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(at));
  }
  bool at_a_message_end() const override { return buffer_.empty(); }

 private:
  void take(const bvt::FrameHeader& header, bvt::BytesView payload) {
    if (header.type == bvt::FrameType::hello_ok) require(bvt::decode_description(payload).has_value());
    if (header.type != bvt::FrameType::ping_data) return;
    const auto ping = bvt::decode_ping(payload);
    require(ping && ping->number >= last_);  // a host with several triggers gets the same ping several times
    last_ = ping->number;
  }
  bvt::Bytes buffer_;
  std::uint32_t last_ = 0;
};

}  // namespace

std::unique_ptr<StreamReader> oculus_reader() { return std::make_unique<OculusReader>(); }
std::unique_ptr<StreamReader> blueview_reader() { return std::make_unique<BlueViewReader>(); }

}  // namespace sonar::fuzz
