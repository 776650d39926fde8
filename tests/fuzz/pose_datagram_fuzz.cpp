// Fuzzes datagrams with poses, in protobuf. Accepted poses are usable, and the same after encoding and decoding.
#include <cmath>

#include "protocol/control/control.hpp"
#include "tests/fuzz/byte_script.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  const auto bytes = std::as_bytes(std::span(data, size));
  const auto sample = control::decode_pose_datagram(bytes);
  if (!sample) {
    fuzz::require(!sample.error().text.empty());
    return 0;
  }
  fuzz::require(size <= control::largest_datagram);
  fuzz::require(is_finite(sample->pose.position_m) && is_finite(sample->pose.orientation));
  fuzz::require(std::abs(norm_squared(sample->pose.orientation) - 1) < 1e-9);
  fuzz::require(std::abs(sample->stamp.ns) <= control::largest_stamp_ns);
  const control::Bytes again = control::encode_pose_datagram(*sample);
  if (again.size() > control::largest_datagram) return 0;  // a name at the limit of the length
  const auto back = control::decode_pose_datagram(again);
  fuzz::require(back && back->seq == sample->seq && back->name == sample->name && back->stamp.ns == sample->stamp.ns);
  fuzz::require(length(back->pose.position_m - sample->pose.position_m) <= 1e-9 * (1 + length(sample->pose.position_m)));
  return 0;
}
