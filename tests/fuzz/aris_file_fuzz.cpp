// Fuzzes .aris files: the reader returns their frames as datagrams of a bounded size.
#include "protocol/aris/aris_file.hpp"
#include "tests/fuzz/recording_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  const recording::Bytes bytes = fuzz::bytes_from(data, size);
  fuzz::check_reader(recording::read_aris_file(recording::source_from("input", bytes)), 2 * size);
  return 0;
}
