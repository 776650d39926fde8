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

/// A message on its way through the faults that meet it.
struct MessageEdit {
  protocol::Bytes bytes;
  std::vector<Outbox::Shape::Pause> pauses;
  Outbox::Shape::End end = Outbox::Shape::End::none;
  bool dropped = false;
};
/// Inputs of a kind beside the message.
struct MessageContext {
  const protocol::Vendor& vendor;
  FaultDraws draws;
  std::uint32_t first_number = 0;           // for renumber: the first ping that had the fault
  std::uint32_t number = 0;                 // number of this ping
  const protocol::Bytes* before = nullptr;  // for splice: the message before; may be null
};

/// Returns where the message was touched, if that is not where its bytes first differ (a pause, an end); false in `.second`: the
/// kind could not act on this message, which stays as it is.
struct Touch {
  bool acted = true;
  std::optional<std::size_t> place = {};
};
Touch alter_message(const Fault& fault, const MessageContext& context, MessageEdit& message);

/// One status message; the list of datagrams sent in its place.
void alter_beacons(const Fault& fault, const protocol::Vendor& vendor, const FaultDraws& draws,
                   std::vector<protocol::Bytes>& datagrams);

}  // namespace sonar
