// Fuzzes .sonar files: the reader returns whole packets, wherever the search for the next one begins.
#include "protocol/waterlinked/sonar_file.hpp"
#include "tests/fuzz/recording_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  fuzz::check_reader(recording::read_sonar_file(recording::source_from("input", fuzz::bytes_from(data, size))), size);
  return 0;
}
