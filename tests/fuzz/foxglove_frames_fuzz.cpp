// Fuzzes binary messages that viewers send: an accepted message is encoded to the same bytes again.
#include <algorithm>

#include "protocol/foxglove/foxglove_frames.hpp"
#include "tests/fuzz/byte_script.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar::foxglove;
  using sonar::fuzz::require;
  const BytesView frame = std::as_bytes(std::span(data, size));
  const auto read = frame_of_viewer(frame);
  if (!read) {
    require(!read.error().text.empty());
    return 0;
  }
  const Bytes again = std::visit([](const auto& message) { return encode(message); }, *read);
  const auto* const control = std::get_if<PlaybackControl>(&*read);
  if (control == nullptr || control->speed == control->speed) require(std::ranges::equal(again, frame));
  return 0;
}
