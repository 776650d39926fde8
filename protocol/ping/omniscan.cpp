#include <algorithm>

#include "protocol/ping/locate.hpp"
#include "protocol/ping/omniscan_settings.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/streaming.hpp"

namespace sonar::ping::omniscan {
namespace {

using protocol::Reaction;
constexpr auto port_table = streaming_ports(51200, "settings, profiles");

class OmniscanDialogue final : public StreamingConversation<Settings, settings_from> {
  /// True while pings are enabled, because ping-python sends nothing while it reads an Omniscan. (Hosts of a Surveyor send,
  /// because it requests the time.)
  bool hosts_fall_silent() const override { return settings().parameters.enable != 0; }

 public:
  using StreamingConversation::StreamingConversation;

 protected:
  /// Handles a request. Accepted requests get no ack. unknown: whether a real device sends one.
  bool on_request(const Frame& frame, Time, Reaction& reaction) override {
    if (frame.header.id == Id::os_ping_params) {
      OsPingParams parameters;
      if (!read(frame, parameters, reaction)) return true;
      if (const std::string why = complaint(parameters); !why.empty()) return refuse(frame, why, reaction), true;
      change(reaction, [&](Settings& s) { s.parameters = parameters; });
    } else if (frame.header.id == Id::set_sound_speed || frame.header.id == Id::set_sound_speed_before) {  // older definitions
      SoundSpeed speed;
      if (!read(frame, speed, reaction)) return true;
      if (speed.mm_per_s < 1000000 || speed.mm_per_s > 2000000)
        return refuse(frame, "speed_of_sound is not in 1000000..2000000", reaction), true;
      change(reaction, [&](Settings& s) { s.speed_mps = static_cast<float>(1e-3 * speed.mm_per_s); });
    } else {
      return false;
    }
    return true;
  }
  Bytes message_now(Id, Time) override { return {}; }
  bool comes_with_pings(Id wanted) const override { return wanted == Id::os_mono_profile && settings().parameters.enable != 0; }
};

class OmniscanVendor final
    : public protocol::VendorWith<models, omniscan::apply_override, locate_omniscan, locate_omniscan, StreamingVendor> {
 public:
  std::string_view name() const override { return "omniscan450"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return streaming_options(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override { return change_to(Settings{}); }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 100.0 / 7 * std::max<int>(settings_from(device.settings.get()).parameters.gain, 0);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time) const override {
    return std::make_unique<OmniscanDialogue>(device, port);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) const override {
    return {profile_of(ping, device)};
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<OmniscanVendor>(); }

}  // namespace sonar::ping::omniscan
