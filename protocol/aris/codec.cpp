// The messages and files of ARIS, for recordings.
#include <array>

#include "protocol/aris/aris.hpp"
#include "protocol/aris/aris_file.hpp"
#include "protocol/aris/encode_frame.hpp"
#include "protocol/aris/models.hpp"

namespace sonar::aris {
namespace {

/// Returns the sender of the first datagram of a frame; only this datagram has the header, which states the product.
std::optional<recording::Sender> sender_of(const recording::RecordedMessage& message) {
  FramePart part;
  if (message.by != recording::Carrier::datagram || !protobuf::read(message.bytes, part)) return std::nullopt;
  if (!part.header || part.header->size() < header_size) return std::nullopt;
  FrameHeader header;
  wire::Reader reader(*part.header);
  fields(reader, header);
  for (const auto& model : models())
    if (static_cast<std::uint32_t>(product_of(*model).system) == header.system) return recording::Sender{model, header.serial};
  return std::nullopt;
}

constexpr std::array<recording::FileKind, 1> kinds{{{
    .ending = ".aris",
    .name = ".aris file",
    .holds = "frames of an ARIS",
    .begins =
        [](BytesView front) {
          return recording::begins_with(front, {'D', 'D', 'F', 5});
        },
    .read = recording::read_aris_file,
    .write = recording::write_aris_file,
}}};

}  // namespace

recording::Codec codec() { return {.files = kinds, .sender = sender_of}; }

}  // namespace sonar::aris
