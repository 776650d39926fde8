// Finds the fields and regions that faults change in the frames of pings.
#pragma once

#include <optional>
#include <utility>

#include "protocol/vendor.hpp"

namespace sonar::ping {

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

/// `frame` must be a ping: device_data (2300) or auto_device_data (2301).
std::optional<protocol::Field> locate_ping360(protocol::FieldName name, protocol::BytesView frame);
std::optional<Place> locate_ping360(protocol::Region region, protocol::BytesView frame);

/// `frames` must be the frames of a ping over TCP, which begin with attitude_report (504), or the frame of one datagram.
std::optional<protocol::Field> locate_surveyor(protocol::FieldName name, protocol::BytesView frames);
std::optional<Place> locate_surveyor(protocol::Region region, protocol::BytesView frames);

/// `frame` must be a ping: os_mono_profile (2198).
std::optional<protocol::Field> locate_omniscan(protocol::FieldName name, protocol::BytesView frame);
std::optional<Place> locate_omniscan(protocol::Region region, protocol::BytesView frame);

/// `frames` must be those of a ping of a Ping1D. Fields are found in the profile or, without a profile, in the distance.
std::optional<protocol::Field> locate_ping1d(protocol::FieldName name, protocol::BytesView frames);
std::optional<Place> locate_ping1d(protocol::Region region, protocol::BytesView frames);

/// `frames` must be those of a ping of an S500. Fields are found only in the profile.
std::optional<protocol::Field> locate_s500(protocol::FieldName name, protocol::BytesView frames);
std::optional<Place> locate_s500(protocol::Region region, protocol::BytesView frames);

}  // namespace sonar::ping
