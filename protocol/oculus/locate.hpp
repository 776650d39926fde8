// Finds the fields and regions of protocol/vendor.hpp in Oculus messages; the offsets are those of messages.hpp.
#pragma once

#include <optional>
#include <utility>

#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// Implements Vendor::field. The version in the header selects the layout of a ping; an empty message stands for version 2.
std::optional<protocol::Field> locate(protocol::Part part, protocol::FieldName name, wire::BytesView message);
/// Implements Vendor::region.
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, wire::BytesView ping);

}  // namespace sonar::oculus
