// Fuzzes capture files: pcap and pcapng, including the messages of a sonar in them.
#include "protocol/recording/pcap/pcap.hpp"
#include "tests/fuzz/recording_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  fuzz::check_reader(recording::read_pcap(recording::source_from("input", fuzz::bytes_from(data, size))), size);
  return 0;
}
