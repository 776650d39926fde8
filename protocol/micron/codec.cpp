// The messages of a Micron, for recordings.
#include "protocol/micron/micron.hpp"
#include "protocol/micron/settings.hpp"

namespace sonar::micron {

namespace {

std::optional<HeadData> head_data_in(BytesView message) {
  const auto read = read_frame(message);
  return read && read->header.id == Id::head_data ? read_front<HeadData>(read->payload) : std::nullopt;
}

std::optional<recording::Sender> sender_of(const recording::RecordedMessage& message) {
  return head_data_in(message.bytes) ? std::optional(recording::Sender{models().front()}) : std::nullopt;
}

std::optional<recording::PingPart> ping_part(BytesView message) {
  const auto data = head_data_in(message);
  if (!data || data->bearing >= turn) return std::nullopt;
  Settings s;
  s.command.control = data->control;
  s.bearing = data->bearing;
  return recording::PingPart{.head_rad = head_rad(s)};
}

}  // namespace

recording::Codec codec() { return {.framing = &framing, .sender = sender_of, .ping_part = ping_part}; }

}  // namespace sonar::micron
