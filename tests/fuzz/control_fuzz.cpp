// Everything that senders of poses can say: datagrams, the control stream and JSON lines. What is accepted must be usable.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "protocol/control/control.hpp"
#include "protocol/control/delimited.hpp"
#include "protocol/control/json_pose.hpp"

namespace {

void check(const sonar::control::PoseSample& sample) {
  if (!is_finite(sample.pose.position_m) || !is_finite(sample.pose.orientation)) std::abort();
  if (std::abs(norm_squared(sample.pose.orientation) - 1) > 1e-9) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar::control;
  const auto bytes = std::as_bytes(std::span(data, size));
  if (const auto sample = decode_pose_datagram(bytes)) check(*sample);
  DelimitedParser messages;
  messages.feed(bytes);
  for (auto message = messages.next(); message && *message; message = messages.next())
    if (const auto request = decode_request(**message))
      if (const auto* sample = std::get_if<PoseSample>(&request->op)) check(*sample);
  LineParser lines;
  lines.feed(bytes);
  while (const auto line = lines.next())
    if (const auto sample = parse_json_pose(line->text)) check(*sample);
  return 0;
}
