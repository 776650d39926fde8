// Fuzzes a sonar's answer to the greeting of the BlueView libraries: the header of a frame, and the description in it. If the
// first byte is odd, the input is a frame, otherwise only the description. An accepted input is encoded to the same bytes.
#include "clients/bvtsdk/core/description.hpp"
#include "clients/bvtsdk/core/frame.hpp"
#include "tests/fuzz/byte_script.hpp"

using namespace sonar::bvt;
using sonar::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  BytesView payload(data + 1, size - 1);
  FrameHeader header;
  if (data[0] % 2 == 1) {
    if (!read_header(payload, header)) return 0;
    require(header.payload_size <= longest_payload);
    Bytes again;
    put_header(again, header);
    require(again.size() == frame_header_size && std::memcmp(again.data(), payload.data, again.size()) == 0);
    payload = {payload.data + frame_header_size, payload.size - frame_header_size};
  }
  // A buffer of exactly the input's size, so that a sanitizer detects a read beyond it.
  const Bytes exact(payload.data, payload.data + payload.size);
  const auto sonar = decode_description(exact);
  if (!sonar) return 0;
  require(sonar->heads.size() <= 255);
  for (const int number : {-1, 0, 1, 2, 255}) {
    const HeadDescription* head = sonar->head(number);
    require(head == nullptr || head->id == number || (sonar->heads.size() == 1 && !sonar->strict_heads()));
  }
  const Bytes again = encode_description(*sonar);
  require(again.size() <= exact.size() && std::memcmp(again.data(), exact.data(), again.size()) == 0);
  return 0;
}
