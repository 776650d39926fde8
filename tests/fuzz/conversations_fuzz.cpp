// Fuzzes conversations between a host and an emulated sonar of any make, in virtual time, with faults and with arbitrary bytes
// injected in both directions. The first byte chooses the make. Commands follow: a letter, a number and, for some letters, bytes
// to inject.
#include "tests/example_make/host_link.hpp"
#include "tests/fuzz/byte_script.hpp"
#include "tests/fuzz/sonar_accounts.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  if (size < 3 || size > 512) return 0;
  fuzz::Script script(data, size);
  host_link::Link link(protocol::makes()[script.byte() % protocol::makes().size()]);
  const auto kinds = fault_kinds();
  for (int commands = 0; !script.ended() && commands < 20; ++commands) {
    const char letter = static_cast<char>(script.byte());
    const std::uint8_t number = script.byte();
    if (letter == 'f') {
      link.add(kinds[number % kinds.size()]);
    } else if (letter == 'e') {
      link.end_faults();
    } else if (letter == 'c') {
      link.reconnect();
    } else if (letter == 's') {
      link.to_sonar(std::as_bytes(script.piece(number)));
    } else if (letter == 'h') {
      link.to_host(number % link.host_ports(), std::as_bytes(script.piece(script.byte())));
    } else {
      link.run(host_link::step * (number % 10));
    }
    fuzz::check_accounts(link.sonar);
  }
  return 0;
}
