// Fuzzes the bytes of a driver to the sonars of every make. Each sonar gets each input at every port. No input may crash a sonar,
// cause an answer that is much longer than the input, or lead to settings that no ping can have.
#include <algorithm>
#include <cmath>
#include <string>

#include "protocol/host.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace {

using namespace sonar;
using fuzz::require;
using PortKind = protocol::Port::Kind;
constexpr std::size_t most_per_byte = 400, most_unasked = 4096;  // the longest are JSON reports of a DVL and greetings

protocol::DeviceState state_of(const protocol::Vendor& vendor) {
  protocol::DeviceState state;
  state.name = "front";
  state.id = 7001;
  state.model = vendor.models().front();
  state.options = *protocol::check_options(vendor, {});
  state.settings = vendor.initial_settings(state).vendor_settings;
  return state;
}

void check(const PingSettings& s) {
  require(s.range_bin_m > 0 && s.range_bin_count >= 1 && s.beam_count >= 1 && s.pulse_width_m > 0);
  require(s.range_start_m >= 0 && s.range_start_m < s.range_m && s.range_m < 2000 && s.rate_hz >= 0 && std::isfinite(s.rate_hz));
  require(s.device_sound_speed_mps >= 1000 && s.device_sound_speed_mps <= 2000 && std::isfinite(s.gain_db));
}

void carry_out(std::span<const protocol::Event> events, protocol::DeviceState& device) {
  for (const protocol::Event& event : events)
    if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
      check(change->settings);
      device.settings = change->vendor_settings;
    }
}

/// Returns the size of the replies.
std::size_t carry_out(const protocol::Reaction& reaction, protocol::DeviceState& device) {
  carry_out(reaction.events, device);
  std::size_t size = 0;
  for (const protocol::Bytes& reply : reaction.replies) size += reply.size();
  return size;
}

void converse(const protocol::Vendor& vendor, const protocol::Port& port, protocol::BytesView bytes) {
  protocol::DeviceState device = state_of(vendor);
  Time now = Time{} + std::chrono::hours(1);
  const auto client = vendor.converse(port, device, now);
  std::size_t answered = 0;
  for (const protocol::BytesView part : {bytes.first(bytes.size() / 2), bytes.subspan(bytes.size() / 2)}) {
    answered += carry_out(client->on_bytes(part, now), device);
    if (bytes.size() % 2 == 0) continue;
    now = std::clamp(client->next_tick(), now, now + std::chrono::seconds(1));
    answered += carry_out(client->on_tick(now, bytes.size() % 4 == 1), device);
    client->on_ping(device.settings.get(), 100, now);
  }
  for (int tick = 0; tick < 4 && client->next_tick() < Time::max(); ++tick) {
    now = std::max(now, client->next_tick());
    answered += carry_out(client->on_tick(now, false), device);
  }
  require(answered <= most_per_byte * bytes.size() + most_unasked);
}

void request(const protocol::Vendor& vendor, const protocol::Port& port, const std::string& text) {
  protocol::DeviceState device = state_of(vendor);
  const std::size_t end = std::min(text.find('\n'), text.size());
  for (const char* method : {"POST", "GET"}) {
    const protocol::ResourceRequest request{method,
                                            "/api/v1/integration" + text.substr(0, end),
                                            "",
                                            "application/json",
                                            text.substr(std::min(end + 1, text.size())),
                                            {127, 0, 0, 1}};
    carry_out(vendor.on_http(port, request, device, Time{} + std::chrono::hours(1)).events, device);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  for (const protocol::Make& make : protocol::makes()) {
    const protocol::Vendor& vendor = *make.device;
    for (const protocol::Port& port : vendor.ports()) {
      if (port.kind == PortKind::tcp_stream || port.kind == PortKind::udp_dialogue) converse(vendor, port, bytes);
      if (port.kind == PortKind::udp_answer) {
        protocol::DeviceState device = state_of(vendor);
        require(carry_out(vendor.on_datagram(port, bytes, device, Time{}), device) <= most_per_byte * size + most_unasked);
      }
      if (port.kind == PortKind::http) request(vendor, port, std::string(data, data + size));
      vendor.is_request(port, bytes);
    }
    for (const auto part : {protocol::Part::ping, protocol::Part::beacon})
      for (const auto name : {protocol::FieldName::gain, protocol::FieldName::rows, protocol::FieldName::ping_id})
        vendor.field(part, name, bytes);
    vendor.region(protocol::Region::image, bytes);
    protocol::Bytes message(bytes.begin(), bytes.end());
    vendor.reseal(bytes, message);
  }
  return 0;
}
