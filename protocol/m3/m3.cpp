#include "protocol/m3/m3.hpp"

#include "protocol/m3/settings.hpp"

namespace sonar::m3 {
namespace {

/// The dialogue of a port that only streams. Bytes of a client are logged and have no effect; the program accepts commands on
/// another port, which is not emulated.
class SilentDialogue final : public protocol::Dialogue {
 public:
  protocol::Reaction on_bytes(BytesView received, Time) override {
    return {{protocol::Notice{std::to_string(received.size()) + " bytes at a port where drivers send none"}}, {}};
  }
  protocol::Reaction on_tick(Time, bool) override { return {}; }
  Time next_tick() const override { return Time::max(); }
  void on_ping_queued(Time) override {}
};

class M3Vendor final : public protocol::VendorWith<models, m3::apply_override, locate, locate, protocol::PushingVendor> {
 public:
  M3Vendor() : VendorWith(tcp_port) {}
  std::string_view name() const override { return "m3"; }
  std::span<const protocol::Option> options() const override { return m3::options(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
  double gain_percent(const protocol::DeviceState& device) const override {
    return m3::gain_percent(settings_from(device.settings.get()));
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState&, Time) const override {
    return std::make_unique<SilentDialogue>();
  }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    return std::make_shared<const protocol::Bytes>(encode_packet(ping, device));
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<M3Vendor>(); }

}  // namespace sonar::m3
