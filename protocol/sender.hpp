// Which make sent a recorded message, and to which port of its hosts.
#pragma once

#include <cstddef>
#include <optional>

#include "protocol/host.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

struct SentBy {
  const protocol::Make* make = nullptr;
  Sender sender;
};
/// nullopt: it is of a client, or of no make that is known.
std::optional<SentBy> sender_of(const RecordedMessage& message);
/// The port at which a host of the make takes messages of this carrier; nullopt: it takes none.
std::optional<std::size_t> host_port(const protocol::Make& make, Carrier by);

}  // namespace sonar::recording
