// Fuzzes the bytes of a host over the BlueView link, in two pieces. No input may crash the dialogue or cause unlimited answers.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "protocol/blueview/blueview.hpp"

using namespace sonar;

namespace {
protocol::DeviceState make_device() {
  protocol::DeviceState d;
  d.name = "front";
  d.id = 7001;
  d.model = protocol::find_profile("blueview-m900-2250-130")->model;
  d.options = *protocol::check_options(blueview::vendor(), {});
  d.settings = blueview::vendor().initial_settings(d).vendor_settings;
  return d;
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const protocol::DeviceState as_it_comes = make_device();
  protocol::DeviceState device = as_it_comes;
  protocol::Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(data[i]);
  blueview::vendor().on_datagram({}, bytes, device, Time{});
  const auto host = blueview::make_dialogue(device, Time{});
  const std::size_t half = size / 2;
  for (const protocol::BytesView part : {protocol::BytesView(bytes).first(half), protocol::BytesView(bytes).subspan(half)}) {
    const protocol::Reaction reaction = host->on_bytes(part, Time{});
    if (reaction.replies.size() > size + 1) std::abort();
    for (const auto& event : reaction.events)
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        device.settings = change->vendor_settings;
        if (!(change->settings.range_bin_m > 0) || change->settings.range_bin_count < 1) std::abort();
      }
    host->on_tick(Time{} + std::chrono::seconds(3), size % 2 == 0);
    host->on_ping(device.settings.get(), 100, Time{});
  }
  return 0;
}
