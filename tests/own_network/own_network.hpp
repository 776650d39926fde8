// Each process that opens sockets in a test gets a network of its own, so that fixed ports and addresses of parallel tests do not
// collide.
#pragma once

namespace sonar::tests {

/// Moves the process into a new network namespace with its loopback interface up. The user stays the same and gains no
/// permissions. If the kernel forbids namespaces, a line on standard error says so, and the process waits until no other process
/// without a network of its own runs. Call it before threads are started. It sets SONARD_OWN_NETWORK and does nothing if that is
/// already set, so child processes share the network.
void enter_own_network();

}  // namespace sonar::tests
