// The messages of a Micron, for recordings.
#include "protocol/micron/host.hpp"
#include "protocol/micron/settings.hpp"

namespace sonar::micron {

recording::Codec codec() {
  return {.framing = &framing, .sender = [](const recording::RecordedMessage& message) -> std::optional<recording::Sender> {
            const auto read = read_frame(message.bytes);
            if (!read || read->header.id != Id::head_data) return std::nullopt;
            return recording::Sender{models().front()};
          }};
}

}  // namespace sonar::micron
