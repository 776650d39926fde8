// Fuzzes JSON lines with poses, in two pieces. Accepted poses are usable; a refusal gives the reason; lines beyond the limit are
// reported.
#include <cmath>

#include "protocol/control/json_pose.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace {

void take_lines(sonar::control::LineParser& lines) {
  using namespace sonar;
  while (const auto line = lines.next()) {
    fuzz::require(line->text.size() <= control::longest_line);
    const auto sample = control::parse_json_pose(line->text);
    if (!sample) {
      fuzz::require(!sample.error().text.empty());
      continue;
    }
    fuzz::require(is_finite(sample->pose.position_m) && is_finite(sample->pose.orientation));
    fuzz::require(std::abs(norm_squared(sample->pose.orientation) - 1) < 1e-9);
    fuzz::require(!sample->velocity_mps || is_finite(*sample->velocity_mps));
    fuzz::require(std::abs(sample->stamp.ns) <= control::largest_stamp_ns);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  sonar::control::LineParser lines;
  lines.feed(bytes.first(size / 2));
  take_lines(lines);
  lines.feed(bytes.subspan(size / 2));
  take_lines(lines);
  // A gap between the pieces changes only the line that contains it.
  sonar::control::LineParser gapped;
  gapped.feed(bytes.first(size / 2));
  gapped.skip_gap();
  gapped.feed(bytes.subspan(size / 2));
  take_lines(gapped);
  return 0;
}
