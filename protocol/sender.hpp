// Finds the make that sent a recorded message, and the host's port that receives it.
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
/// nullopt: a client sent it, or no known make.
std::optional<SentBy> sender_of(const RecordedMessage& message);
/// The index of the port at which a host of the make receives messages of this carrier; nullopt: there is none.
std::optional<std::size_t> host_port(const protocol::Make& make, Carrier by);

}  // namespace sonar::recording
