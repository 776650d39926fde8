// Fuzzes the bytes of a device to our driver-side decoder. The first byte gives the length of the pieces; the rest is the stream.
// The test reads every sample, gain and bearing that a decoded ping states, so that a sanitizer detects missing bytes.
#include <algorithm>
#include <cstdlib>

#include "protocol/oculus/decode.hpp"

namespace {

using namespace sonar;

std::uint64_t touch(const oculus::DecodedPing& ping) {
  std::uint64_t sum = ping.violations.size();
  for (std::size_t row = 0; row < ping.rows(); ++row) {
    for (std::size_t beam = 0; beam < ping.beams(); ++beam) sum += ping.sample(row, beam);
    if (!ping.row_samples(row).empty()) sum += std::to_integer<std::uint64_t>(ping.row_samples(row).back());
  }
  for (std::size_t beam = 0; beam < ping.beams(); ++beam) sum += ping.azimuth_rad(beam) > 0 ? 1 : 0;
  for (const std::uint32_t gain : ping.row_gains) sum += gain;
  return sum;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = 16 * data[0] + std::size_t{1};
  std::vector<std::byte> stream;
  for (std::size_t i = 1; i < size; ++i) stream.push_back(static_cast<std::byte>(data[i]));
  static_cast<void>(oculus::decode_status(stream));
  oculus::Decoder decoder;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    decoder.append(wire::BytesView(stream).subspan(at, std::min(piece, stream.size() - at)));
    while (const auto received = decoder.next())
      if (const auto* ping = std::get_if<oculus::DecodedPing>(&*received); ping != nullptr && touch(*ping) == ~std::uint64_t{0})
        return 1;
    if (decoder.buffered_bytes() > oculus::reply_limit) std::abort();
  }
  return 0;
}
