// Replaces nats_queue.cpp if libnats 3.3 was not found.
#include "daemon/commands/farm/queue.hpp"

namespace sonar::farm {

Result<std::unique_ptr<Queue>> connect(const QueueOptions&) {
  return failure(ErrorKind::unavailable,
                 "this sonard was built without the farm: install libnats-dev 3.3 or newer and build it again, or divide "
                 "the shards among machines with sonard dataset --shards I/N");
}

}  // namespace sonar::farm
