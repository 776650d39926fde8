#include "clients/sonarctl/any_ping.hpp"

namespace sonar::clients {

PingFacts facts_of(const AnyPing& any) {
  if (const auto* of = std::get_if<PicturePing>(&any)) return of->facts;
  PingFacts facts;
  if (const auto* ping = std::get_if<oculus::DecodedPing>(&any)) {
    const oculus::PingResultV2& f = ping->head.fixed;
    facts = {f.ping_id,
             f.beam_count,
             f.row_count,
             static_cast<unsigned>(8 * ping->bytes_per_sample()),
             f.range_resolution_m,
             f.row_count * f.range_resolution_m,
             f.frequency_hz,
             ping->message.size()};
  } else if (const auto* aris = std::get_if<ArisPing>(&any)) {
    const aris::FrameHeader& h = aris->frame.header;
    const double length_m = static_cast<double>(h.window_length_m);
    facts = {static_cast<std::uint32_t>(aris->frame.index),
             static_cast<unsigned>(aris->frame.beams),
             static_cast<unsigned>(aris->frame.samples),
             8,
             length_m / static_cast<double>(aris->frame.samples),
             static_cast<double>(h.window_start_m) + length_m,
             aris->frequency_hz,
             aris->message_size};
  } else {
    const auto& [polar, frequency_hz, size] = std::get<BlueViewPing>(any);
    facts = {polar.number,
             static_cast<unsigned>(polar.beams),
             static_cast<unsigned>(polar.bins),
             16,
             static_cast<double>(polar.bin_m),
             static_cast<double>(polar.stop_m),
             frequency_hz,
             size};
  }
  return facts;
}

}  // namespace sonar::clients
