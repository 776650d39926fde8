// Bytes of a host to devices of the ping protocol, in two pieces: no byte may crash a dialogue, be answered by much more
// than was sent, or lead to settings that no ping can have.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "protocol/vendor.hpp"

using namespace sonar;

namespace {
struct Device {
  explicit Device(const char* profile) : found(*protocol::find_profile(profile)) {
    state.name = "front";
    state.model = found.model;
    state.options = *protocol::check_options(*found.vendor, {});
    state.settings = found.vendor->initial_settings(state).vendor_settings;
  }
  protocol::Profile found;
  protocol::DeviceState state;
};

void apply(const protocol::Reaction& reaction, protocol::DeviceState& device) {
  for (const auto& event : reaction.events)
    if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
      device.settings = change->vendor_settings;
      const PingSettings& s = change->settings;
      const bool possible = s.range_bin_m > 0 && s.range_bin_count >= 1 && s.range_bin_count <= 1200 && s.pulse_width_m > 0 &&
                            s.rate_hz >= 0 && s.range_start_m >= 0 && s.range_start_m < s.range_m && s.range_m < 2000;
      if (!possible) std::abort();
    }
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  protocol::Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(data[i]);
  static const Device devices[] = {Device("ping360"), Device("surveyor-240"), Device("omniscan-450"), Device("ping1d"),
                                   Device("s500")};
  for (const Device& as_it_comes : devices) {
    protocol::DeviceState device = as_it_comes.state;
    const protocol::Vendor& vendor = *as_it_comes.found.vendor;
    for (const protocol::Port& port : vendor.ports()) {
      if (port.kind == protocol::Port::Kind::udp_answer) {
        if (vendor.on_datagram(port, bytes, device, Time{}).replies.size() > 1) std::abort();
        continue;
      }
      const auto host = vendor.converse(port, device, Time{});
      std::size_t answered = 0;
      const std::size_t half = size / 2;
      for (const protocol::BytesView part : {protocol::BytesView(bytes).first(half), protocol::BytesView(bytes).subspan(half)}) {
        const protocol::Reaction reaction = host->on_bytes(part, Time{});
        for (const protocol::Bytes& reply : reaction.replies) answered += reply.size();
        apply(reaction, device);
      }
      if (answered > 20 * size + 256) std::abort();
      for (int tick = 0; tick < 4 && host->next_tick() < Time::max(); ++tick)
        apply(host->on_tick(host->next_tick(), false), device);
    }
    vendor.is_request(vendor.ports().front(), bytes);
    vendor.field(protocol::Part::ping, protocol::FieldName::gain, bytes);
    vendor.region(protocol::Region::image, bytes);
  }
  return 0;
}
