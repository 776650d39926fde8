// Finds the fields and regions that faults name in the frames of pings.
#pragma once

#include <optional>
#include <utility>

#include "protocol/vendor.hpp"

namespace sonar::ping {

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

/// The frame is a ping, 2300 or 2301.
std::optional<protocol::Field> locate_ping360(protocol::FieldName name, protocol::BytesView frame);
std::optional<Place> locate_ping360(protocol::Region region, protocol::BytesView frame);

/// The frames are those of a ping over TCP: the first is 504.
std::optional<protocol::Field> locate_surveyor(protocol::FieldName name, protocol::BytesView frames);
std::optional<Place> locate_surveyor(protocol::Region region, protocol::BytesView frames);

/// The frame is a ping, 2198.
std::optional<protocol::Field> locate_omniscan(protocol::FieldName name, protocol::BytesView frame);
std::optional<Place> locate_omniscan(protocol::Region region, protocol::BytesView frame);

/// The frames are those of a ping of a Ping1D: the profile, or else the distance.
std::optional<protocol::Field> locate_ping1d(protocol::FieldName name, protocol::BytesView frames);
std::optional<Place> locate_ping1d(protocol::Region region, protocol::BytesView frames);

/// The frames are those of a ping of an S500; only its profile has places.
std::optional<protocol::Field> locate_s500(protocol::FieldName name, protocol::BytesView frames);
std::optional<Place> locate_s500(protocol::Region region, protocol::BytesView frames);

}  // namespace sonar::ping
