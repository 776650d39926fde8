// Effects on the bytes of messages: faults of the stages framing, stream and link change one ping of one client; faults of the
// stage status change status messages.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/random.hpp"
#include "core/base/units.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/config/faults/fault.hpp"
#include "daemon/emulator/connections/outbox.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

// Random numbers for faults. They depend only on the seed, the fault, the sonar, the ping and the client.

struct FaultDraws {
  Seed seed{};
  std::uint32_t fault = 0;  // key made from the fault's name
  std::uint32_t sonar = 0, ping = 0, client = 0;

  /// Returns the draw with that index, 32 random bits.
  std::uint32_t bits(std::uint32_t index) const {
    const auto key = static_cast<std::uint64_t>(seed);
    return philox(index, ping, client, sonar ^ fault, static_cast<std::uint32_t>(key) ^ fault,
                  static_cast<std::uint32_t>(key >> 32))
        .v[0];
  }
  /// Returns a number below `end`; `end` > 0.
  std::size_t below(std::size_t end, std::uint32_t index) const { return static_cast<std::size_t>(bits(index)) % end; }
  /// Returns a value in (0, 1).
  double uniform(std::uint32_t index) const { return static_cast<double>(uniform_open(bits(index))); }
};

/// A message and its shape, which several faults change one after the other.
struct MessageEdit {
  protocol::Bytes bytes;
  std::vector<Outbox::Shape::Pause> pauses;
  Outbox::Shape::End end = Outbox::Shape::End::none;
  bool dropped = false;
};
/// Other inputs of an effect.
struct MessageContext {
  const protocol::Vendor& vendor;
  FaultDraws draws;
  std::uint32_t first_number = 0;           // for renumber: number of the first ping with the fault
  std::uint32_t number = 0;                 // number of this ping
  const protocol::Bytes* before = nullptr;  // for splice: the previous message; may be null
};

/// The result of a fault for a message.
struct Touch {
  bool acted = true;                      // false: the message is unchanged
  std::optional<std::size_t> place = {};  // the byte at which the message pauses or ends; nullopt: the first changed byte
};
Touch alter_message(const Fault& fault, const MessageContext& context, MessageEdit& message);

/// Changes the list of datagrams of one status broadcast.
void alter_beacons(const Fault& fault, const protocol::Vendor& vendor, const FaultDraws& draws,
                   std::vector<protocol::Bytes>& datagrams);

// Effects of faults of the stage payload on the samples of a ping.

/// Changes the samples. `kept`: the ping that the effect `stuck` repeats, or null. `begun`: number of pings since the fault
/// began, 0 for the first.
void alter_ping(const Fault& fault, const FaultDraws& draws, const Ping* kept, std::uint64_t begun, Ping& ping);

}  // namespace sonar
