// The packets of an M3, for recordings. A file of the maker's program (.imb) has the packets of the stream, one after the other
// (CLI).
#include <array>

#include "protocol/m3/m3.hpp"
#include "protocol/m3/settings.hpp"
#include "protocol/recorded/message_splitter.hpp"

namespace sonar::m3 {
namespace {

std::optional<recording::Sender> sender_of(const recording::RecordedMessage& message) {
  const auto packet = read_packet(message.bytes);
  return packet ? std::optional(recording::Sender{models().front(), packet->header.front.sonar_info[0]}) : std::nullopt;
}

constexpr std::array<recording::FileKind, 1> kinds{{{
    .ending = ".imb",
    .name = ".imb file",
    .holds = "packets of an M3",
    .begins =
        [](BytesView front) {
          return recording::begins_with(front, {0x00, 0x80, 0x00, 0x80, 0x00, 0x80, 0x00, 0x80});  // sync_word four times
        },
    .read = [](std::unique_ptr<recording::Source> source) { return recording::read_raw_dump(std::move(source), framing); },
    .write = [](std::unique_ptr<recording::Sink> sink) { return recording::write_raw_dump(std::move(sink)); },
    .is_raw_dump = true,
}}};

}  // namespace

recording::Codec codec() { return {.framing = &framing, .files = kinds, .sender = sender_of}; }

}  // namespace sonar::m3
