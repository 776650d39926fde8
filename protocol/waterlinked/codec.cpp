// The messages and files of Water Linked sonars, for recordings.
#include <array>

#include "protocol/recorded/message_splitter.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "protocol/waterlinked/settings.hpp"
#include "protocol/waterlinked/sonar_file.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

namespace sonar::waterlinked {
namespace {

/// Returns the sender of a datagram. Packets do not state the model, so the first model is assumed.
std::optional<recording::Sender> sender_of(const recording::RecordedMessage& message) {
  if (message.by != recording::Carrier::datagram || rip_length(message.bytes) != message.bytes.size()) return std::nullopt;
  return recording::Sender{models().front()};
}

constexpr std::array<recording::FileKind, 1> kinds{{{
    .ending = ".sonar",
    .name = ".sonar file",
    .holds = "images of a Sonar 3D-15",
    .begins =
        [](BytesView front) {
          return recording::begins_with(front, {'R', 'I', 'P', '1'}) || recording::begins_with(front, {'R', 'I', 'P', '2'});
        },
    .read = [](std::unique_ptr<recording::Source> source) -> Result<std::unique_ptr<recording::RecordingReader>> {
      return recording::read_sonar_file(std::move(source));
    },
    .write =
        [](std::unique_ptr<recording::Sink> sink) {  // the file has successive datagrams
          return recording::write_raw_dump(std::move(sink), recording::Carrier::datagram);
        },
    .is_raw_dump = true,
}}};

}  // namespace

recording::Codec codec() { return {.files = kinds, .sender = sender_of}; }

}  // namespace sonar::waterlinked
