// The messages of a DVL, for recordings.
#include "protocol/dvl/host.hpp"
#include "protocol/dvl/models.hpp"
#include "protocol/dvl/reports.hpp"

namespace sonar::dvl {
namespace {

// Messages are lines: Framing::length is null, so a message ends with the line.
constexpr recording::Framing framing{.magic = {'{', '"'}, .header_size = 2};

}  // namespace

recording::Codec codec() {
  return {.framing = &framing, .sender = [](const recording::RecordedMessage& message) -> std::optional<recording::Sender> {
            if (!recording::begins_with(message.bytes, {'{', '"'}) || message.bytes.size() > longest_line) return std::nullopt;
            // Reports do not have the model, so the first model is assumed.
            return read_line(message.bytes).velocity ? std::optional(recording::Sender{models().front()}) : std::nullopt;
          }};
}

}  // namespace sonar::dvl
