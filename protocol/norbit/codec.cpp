// The packets of a Norbit, for recordings.
#include "protocol/norbit/norbit.hpp"
#include "protocol/norbit/settings.hpp"

namespace sonar::norbit {
namespace {

/// Returns the sender of the first packet. In a recording that sonard made, one message holds both packets of a ping.
std::optional<recording::Sender> sender_of(const recording::RecordedMessage& message) {
  const auto size = framing.length(message.bytes, recording::Origin::device, true);
  if (!size || *size > message.bytes.size()) return std::nullopt;
  const BytesView packet = BytesView(message.bytes).first(*size);
  std::optional<int> mode;
  if (const auto bathymetry = read_bathymetry(packet)) mode = bathymetry->front.sonar_mode;
  if (const auto column = read_column(packet)) mode = column->front.sonar_mode;
  if (!mode) return std::nullopt;
  return recording::Sender{*mode == 0 ? models().back() : models().front()};
}

std::optional<recording::PingPart> ping_part(BytesView packet) {
  if (read_bathymetry(packet)) return recording::PingPart{.port = bathymetry_port};
  if (read_column(packet)) return recording::PingPart{.port = column_port};
  return std::nullopt;
}

}  // namespace

recording::Codec codec() { return {.framing = &framing, .sender = sender_of, .ping_part = ping_part}; }

}  // namespace sonar::norbit
