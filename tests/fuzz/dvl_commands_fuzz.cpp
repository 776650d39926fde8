// Fuzzes the bytes of a client to a DVL, in two pieces. No input may crash the dialogue, lead to settings that no ping can have,
// or cause an answer that is much longer than the input. The same bytes are also used as a line of the device, and as the pixels
// of a ping.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"

using namespace sonar;

namespace {
void require(bool holds) {
  if (!holds) std::abort();
}

void apply(const protocol::Reaction& reaction, protocol::DeviceState& device, std::size_t& answered) {
  for (const auto& event : reaction.events)
    if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
      device.settings = change->vendor_settings;
      const PingSettings& s = change->settings;
      require(s.range_bin_m > 0 && s.pulse_width_m > 0 && s.rate_hz >= 0 && s.range_start_m > 0 && s.range_start_m < s.range_m &&
              s.range_m < 200 && s.device_sound_speed_mps >= 1000 && s.device_sound_speed_mps <= 2000);
    }
  for (const protocol::Bytes& reply : reaction.replies) answered += reply.size();
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  protocol::Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(data[i]);
  protocol::DeviceState device;
  device.model = dvl::models().front();
  const protocol::Vendor& vendor = dvl::vendor();
  protocol::ChangeSettings change = vendor.initial_settings(device);
  device.settings = change.vendor_settings;
  const std::size_t half = size / 2;
  for (const protocol::Port& port : vendor.ports()) {
    const auto client = vendor.converse(port, device, Time{});
    std::size_t answered = 0;
    for (const protocol::BytesView part : {protocol::BytesView(bytes).first(half), protocol::BytesView(bytes).subspan(half)})
      apply(client->on_bytes(part, Time{}), device, answered);
    require(answered <= 400 * (size + 1));  // the shortest JSON object has two bytes
    for (int tick = 0; tick < 4; ++tick) apply(client->on_tick(client->next_tick(), false), device, answered);
  }
  dvl::read_line(bytes);
  const recording::Codec codec = dvl::codec();
  if (const auto part = codec.ping_part(bytes))  // a sentence of the serial protocol is only for that port
    require(codec.answer(bytes, nullptr).size() == (part->port == dvl::tcp_port ? 2u : 1u));

  Ping ping;
  ping.request.model = device.model;
  ping.request.settings = change.settings;
  ping.request.vendor_settings = device.settings;
  ping.samples = bytes;
  const dvl::Measurement m = dvl::measure(ping);
  require(std::isfinite(m.fom) && is_finite(m.velocity_mps) && std::isfinite(m.altitude_m));
  for (const protocol::Port& port : vendor.ports()) vendor.datagrams(port, ping, device);
  require(vendor.after_ping(ping, device).has_value());
  return 0;
}
