// Finds the fields and regions of an mtHeadData frame that faults change.
#include "protocol/micron/settings.hpp"

namespace sonar::micron {

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView frame) {
  const auto found = wire::locate<Header>(name, frame);
  return found ? found : wire::locate<HeadData>(name, frame, header_size);
}

std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView frame) {
  constexpr std::size_t data = header_size + wire::wire_size<HeadData>();
  if (region == protocol::Region::bearings) return std::nullopt;
  if (frame.empty()) return std::pair<std::size_t, std::size_t>{};
  if (frame.size() <= data) return std::nullopt;
  if (region == protocol::Region::header) return std::pair{std::size_t{0}, header_size};
  return region == protocol::Region::metadata ? std::pair{header_size, data - header_size}
                                              : std::pair{data, frame.size() - 1 - data};  // without the line feed
}

}  // namespace sonar::micron
