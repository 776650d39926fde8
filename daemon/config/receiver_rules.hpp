// Determines which addresses clients may request as receivers of a sonar's pings.
#pragma once

#include "daemon/config/config.hpp"

namespace sonar {

/// True for addresses of single computers, and for broadcast addresses and multicast groups that the product (`port`, of kind
/// udp_stream) or the configuration (SonarConfig::groups) names.
bool may_receive(const Ipv4& ip, const protocol::Port& port, const SonarConfig& sonar);

}  // namespace sonar
