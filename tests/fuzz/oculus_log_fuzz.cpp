// Fuzzes .oculus log files and raw dumps. A compressed item may contain a message of the maximum size.
#include "protocol/oculus/messages.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/oculus/oculus_log.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "tests/fuzz/recording_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  const recording::Bytes bytes = fuzz::bytes_from(data, size);
  const std::uint64_t items = size / 40;
  fuzz::check_reader(recording::read_oculus_log(recording::source_from("input", bytes)), items * oculus::reply_limit);
  fuzz::check_reader(recording::read_raw_dump(recording::source_from("input", bytes), oculus::framing), size);
  return 0;
}
