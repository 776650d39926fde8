// Effects on the bytes of messages: faults of the stages framing, stream and link change one ping of one client, faults of the
// stage status change status messages. Pure functions.
#pragma once

#include <optional>
#include <vector>

#include "daemon/config/faults/fault.hpp"
#include "daemon/emulator/connections/outbox.hpp"
#include "daemon/emulator/faults/draws.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

/// A message and its shape, which several faults change one after the other.
struct MessageEdit {
  protocol::Bytes bytes;
  std::vector<Outbox::Shape::Pause> pauses;
  Outbox::Shape::End end = Outbox::Shape::End::none;
  bool dropped = false;
};
/// Other inputs of a fault's effect.
struct MessageContext {
  const protocol::Vendor& vendor;
  FaultDraws draws;
  std::uint32_t first_number = 0;           // for renumber: number of the first ping with the fault
  std::uint32_t number = 0;                 // number of this ping
  const protocol::Bytes* before = nullptr;  // for splice: the previous message; may be null
};

/// True if a fault acted on a message, and at which byte, if that is not the first changed byte (for a pause or an end).
struct Touch {
  bool acted = true;
  std::optional<std::size_t> place = {};
};
Touch alter_message(const Fault& fault, const MessageContext& context, MessageEdit& message);

/// Changes the list of datagrams of one status broadcast.
void alter_beacons(const Fault& fault, const protocol::Vendor& vendor, const FaultDraws& draws,
                   std::vector<protocol::Bytes>& datagrams);

}  // namespace sonar
