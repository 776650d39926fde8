// Operators on the bytes of messages: what the kinds of the stages framing, stream and link do to one ping of one client, and
// what those of the stage status do to status messages. Pure functions.
#pragma once

#include <optional>
#include <vector>

#include "daemon/config/faults/fault.hpp"
#include "daemon/emulator/connections/outbox.hpp"
#include "daemon/emulator/faults/draws.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

/// A message, as the faults that act on it change it one after the other.
struct MessageEdit {
  protocol::Bytes bytes;
  std::vector<Outbox::Shape::Pause> pauses;
  Outbox::Shape::End end = Outbox::Shape::End::none;
  bool dropped = false;
};
/// Further inputs of a fault.
struct MessageContext {
  const protocol::Vendor& vendor;
  FaultDraws draws;
  std::uint32_t first_number = 0;           // for renumber: the first ping that had the fault
  std::uint32_t number = 0;                 // number of this ping
  const protocol::Bytes* before = nullptr;  // for splice: the message before; may be null
};

/// The effect of a fault on a message: whether it acted, and where, if that is not where the bytes first differ (a pause, an
/// end).
struct Touch {
  bool acted = true;
  std::optional<std::size_t> place = {};
};
Touch alter_message(const Fault& fault, const MessageContext& context, MessageEdit& message);

/// Changes the list of datagrams that is sent for one status message.
void alter_beacons(const Fault& fault, const protocol::Vendor& vendor, const FaultDraws& draws,
                   std::vector<protocol::Bytes>& datagrams);

}  // namespace sonar
