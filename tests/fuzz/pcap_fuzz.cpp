// Capture files of any origin: pcap and pcapng, down to the messages of a sonar.
#include "protocol/recording/pcap/pcap.hpp"
#include "tests/fuzz/recording_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  fuzz::check_reader(recording::read_pcap(recording::source_from("input", fuzz::bytes_from(data, size))), size);
  return 0;
}
