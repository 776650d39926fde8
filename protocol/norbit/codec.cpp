// The packets of a Norbit, for recordings.
#include "protocol/norbit/host.hpp"
#include "protocol/norbit/models.hpp"
#include "protocol/norbit/packet.hpp"

namespace sonar::norbit {

recording::Codec codec() {
  return {.framing = &framing, .sender = [](const recording::RecordedMessage& message) -> std::optional<recording::Sender> {
            std::optional<int> mode;
            if (const auto bathymetry = read_bathymetry(message.bytes)) mode = bathymetry->front.sonar_mode;
            if (const auto column = read_column(message.bytes)) mode = column->front.sonar_mode;
            if (!mode) return std::nullopt;
            return recording::Sender{*mode == 0 ? models().back() : models().front()};
          }};
}

}  // namespace sonar::norbit
