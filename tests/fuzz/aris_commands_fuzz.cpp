// Fuzzes the bytes of a controller to an ARIS, in two pieces, and a part of a frame. No input may crash the dialogue, cause an
// answer, or lead to settings that no ping can have.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "protocol/aris/aris.hpp"
#include "protocol/aris/encode_frame.hpp"

using namespace sonar;

namespace {
protocol::DeviceState make_device() {
  protocol::DeviceState d;
  d.name = "front";
  d.id = 7001;
  d.model = protocol::find_profile("aris-1800")->model;
  d.options = *protocol::check_options(aris::vendor(), {});
  d.settings = aris::vendor().initial_settings(d).vendor_settings;
  return d;
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const protocol::DeviceState as_it_comes = make_device();
  protocol::DeviceState device = as_it_comes;
  protocol::Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(data[i]);
  const auto controller = aris::vendor().converse({}, device, Time{});
  const std::size_t half = size / 2;
  for (const protocol::BytesView part : {protocol::BytesView(bytes).first(half), protocol::BytesView(bytes).subspan(half)}) {
    const protocol::Reaction reaction = controller->on_bytes(part, Time{});
    if (!reaction.replies.empty()) std::abort();
    for (const auto& event : reaction.events)
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        device.settings = change->vendor_settings;
        const PingSettings& s = change->settings;
        const bool possible = s.range_bin_m > 0 && s.range_bin_count >= 128 && s.range_bin_count <= 4096 && s.pulse_width_m > 0 &&
                              s.rate_hz >= 0 && s.rate_hz <= 15 && s.range_m < 500;
        if (!possible) std::abort();
      }
  }
  aris::FrameAssembler assembler;
  assembler.add(bytes);
  assembler.add(protocol::BytesView(bytes).subspan(half));
  aris::vendor().field(protocol::Part::ping, protocol::FieldName::rows, bytes);
  aris::vendor().region(protocol::Region::image, bytes);
  const auto next = [](std::int64_t n) { return n + 1; };
  protocol::Bytes part = bytes, beacon = bytes;
  for (const auto name : {protocol::FieldName::ping_id, protocol::FieldName::image_size})
    aris::vendor().change_integer(protocol::Part::ping, name, next, part);
  for (const auto name : {protocol::FieldName::device_id, protocol::FieldName::device_status})
    aris::vendor().change_integer(protocol::Part::beacon, name, next, beacon);
  return 0;
}
