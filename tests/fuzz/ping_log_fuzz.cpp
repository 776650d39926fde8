// Fuzzes logs of the ping protocol: the reader returns their frames unchanged.
#include "protocol/ping/ping_log.hpp"
#include "tests/fuzz/recording_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  const recording::Bytes bytes = fuzz::bytes_from(data, size);
  fuzz::check_reader(recording::read_ping_log(recording::source_from("input", bytes)), size);
  return 0;
}
