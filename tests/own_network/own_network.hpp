// A network of its own for each process that opens sockets in a test: fixed ports and addresses of tests that run at the same
// time do not collide.
#pragma once

namespace sonar::tests {

/// Moves the process into a new network namespace with its loopback interface up. User and file permissions stay as they are.
/// Where the kernel forbids it the process waits until no other one of these runs, and prints that to standard error. Call it
/// before threads are started. Does nothing when SONARD_OWN_NETWORK is set, which it sets: child processes share the network.
void enter_own_network();

}  // namespace sonar::tests
