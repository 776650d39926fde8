// Fuzzes requests to a Sonar 3D-15 (a path, a line end and a body) and a packet of images. No input may crash it or lead to
// settings that no ping can have.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "protocol/waterlinked/messages.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

using namespace sonar;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const protocol::Vendor& vendor = waterlinked::vendor();
  protocol::DeviceState device;
  device.id = 7001;
  device.model = vendor.models().front();
  device.options = *protocol::check_options(vendor, {});
  device.settings = vendor.initial_settings(device).vendor_settings;
  const std::string text(data, data + size);
  const std::size_t end = std::min(text.find('\n'), text.size());
  for (const char* method : {"POST", "GET"}) {
    const protocol::ResourceRequest request{method,
                                            "/api/v1/integration" + text.substr(0, end),
                                            "",
                                            "application/json",
                                            text.substr(std::min(end + 1, text.size())),
                                            {127, 0, 0, 1}};
    const protocol::ResourceReply reply =
        vendor.on_http(*vendor.port(protocol::Port::Kind::http), request, device, Time{} + std::chrono::hours(1));
    if ((reply.status == 204) != reply.body.empty()) std::abort();
    for (const protocol::Event& event : reply.events)
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        device.settings = change->vendor_settings;
        const PingSettings& s = change->settings;
        const bool possible = s.range_bin_m > 0 && s.range_m <= 15 && s.range_start_m >= 0 && s.rate_hz >= 0 && s.rate_hz <= 20 &&
                              s.device_sound_speed_mps >= 1000 && s.device_sound_speed_mps <= 2000;
        if (!possible) std::abort();
      }
  }
  wire::Bytes bytes;
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  waterlinked::decode(bytes);
  waterlinked::rip_content(bytes);
  return 0;
}
