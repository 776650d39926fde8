// A make (Vendor) that passes every call to another; tests override the functions that they change.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "protocol/vendor.hpp"

namespace sonar::protocol {

class DelegatingVendor : public Vendor {
 public:
  /// `of` must outlive this object.
  explicit DelegatingVendor(const Vendor& of) : of_(of) {}
  std::string_view name() const override { return of_.name(); }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return of_.models(); }
  std::span<const Port> ports() const override { return of_.ports(); }
  std::span<const Option> options() const override { return of_.options(); }
  int default_max_clients() const override { return of_.default_max_clients(); }
  Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model,
                                                  const OptionValues& options) const override {
    return of_.tuned(std::move(model), options);
  }
  ChangeSettings initial_settings(const DeviceState& device) const override { return of_.initial_settings(device); }
  Result<ChangeSettings> apply_override(const SettingsOverride& wanted, const DeviceState& device) const override {
    return of_.apply_override(wanted, device);
  }
  double gain_percent(const DeviceState& device) const override { return of_.gain_percent(device); }
  bool keeps_settings() const override { return of_.keeps_settings(); }
  PingsBy pings_by() const override { return of_.pings_by(); }
  bool pings_before_first_request(const DeviceState& device) const override { return of_.pings_before_first_request(device); }
  std::optional<ChangeSettings> after_ping(const Ping& ping, const DeviceState& device) const override {
    return of_.after_ping(ping, device);
  }
  std::optional<Time> leaves_at(const Ping& ping, const DeviceState& device) const override {
    return of_.leaves_at(ping, device);
  }
  Bytes beacon(const DeviceState& device, Time now) const override { return of_.beacon(device, now); }
  Reaction on_datagram(const Port& port, BytesView datagram, const DeviceState& device, Time now) const override {
    return of_.on_datagram(port, datagram, device, now);
  }
  std::unique_ptr<Dialogue> converse(const Port& port, const DeviceState& device, Time now) const override {
    return of_.converse(port, device, now);
  }
  ResourceReply on_http(const Port& port, const ResourceRequest& request, const DeviceState& device, Time now) const override {
    return of_.on_http(port, request, device, now);
  }
  std::vector<Bytes> datagrams(const Port& port, const Ping& ping, const DeviceState& device) const override {
    return of_.datagrams(port, ping, device);
  }
  std::shared_ptr<const Bytes> frame(const Ping& ping, const DeviceState& device) const override {
    return of_.frame(ping, device);
  }
  std::optional<Field> field(Part part, FieldName name, BytesView message) const override {
    return of_.field(part, name, message);
  }
  std::optional<std::pair<std::size_t, std::size_t>> region(Region region, BytesView ping) const override {
    return of_.region(region, ping);
  }

 private:
  const Vendor& of_;
};

}  // namespace sonar::protocol
