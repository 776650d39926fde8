// Each process that opens sockets in a test gets a network of its own, so that fixed ports and addresses of parallel tests do not
// collide.
#pragma once

namespace sonar::tests {

/// Moves the process into a new network namespace with its loopback interface up. User and file permissions stay as they are.
/// If the kernel forbids it, the process waits until no other such process runs, and reports that on standard error. Call it
/// before threads are started. It sets SONARD_OWN_NETWORK and does nothing if that is already set, so child processes share the
/// network.
void enter_own_network();

}  // namespace sonar::tests
