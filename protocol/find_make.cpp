#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "protocol/host.hpp"
#include "protocol/vendor.hpp"

namespace sonar::protocol {

const Make* find_make(std::string_view name) {
  for (const Make& make : makes())
    if (make.name() == name) return &make;
  return nullptr;
}

std::vector<DriverAddress> driver_addresses(const Vendor& vendor, Ipv4 ip, std::span<const Endpoint> status_to) {
  std::vector<DriverAddress> all;
  for (const Port& port : vendor.ports()) {
    using Kind = Port::Kind;
    if (port.kind == Kind::tcp_stream) all.push_back({"tcp", {ip, port.number}, port.carries});
    if (port.kind == Kind::udp_dialogue || port.kind == Kind::udp_answer) all.push_back({"udp", {ip, port.number}, port.carries});
    if (port.kind == Kind::http) all.push_back({"http", {ip, port.number}, port.carries});
    if (port.kind == Kind::udp_stream && port.group.port != 0) all.push_back({"multicast", port.group, port.carries, true});
    if (port.kind == Kind::udp_beacon)
      for (const Endpoint& to : status_to)
        all.push_back({"status", {to.ip, to.port == 0 ? port.number : to.port}, port.carries, true});
  }
  return all;
}

std::string line_of(std::string_view protocol, std::string_view at, std::string_view carries, bool sonar_speaks_first) {
  std::string line = text::format("%-10.*s %-26.*s ", static_cast<int>(protocol.size()), protocol.data(),
                                  static_cast<int>(at.size()), at.data());
  if (!carries.empty()) line.append(carries).append("; ");
  return line + (sonar_speaks_first ? "sent without a request" : "waits for the driver");
}

Result<SonarPicture> drawing_of(const HostPing& ping) {
  if (ping.drawing) return ping.drawing();
  return ping.picture().map([](PolarImage image) { return SonarPicture{.image = std::move(image)}; });
}

const Make& make_of_profile(std::string_view profile) {
  for (const Make& make : makes())
    for (const auto& model : make.device->models())
      if (model->profile == profile) return make;
  return makes().front();
}

std::span<const Vendor* const> vendors() {
  static const std::vector<const Vendor*> all = [] {
    std::vector<const Vendor*> devices;
    for (const Make& make : makes()) devices.push_back(make.device);
    return devices;
  }();
  return all;
}

// If two makes have a profile with the same name, the first make is used, as in make_of_profile().
Result<Profile> find_profile(std::string_view profile) {
  std::vector<std::string_view> names;
  for (const Vendor* vendor : vendors()) {
    for (const auto& model : vendor->models()) {
      if (model->profile == profile) return Profile{vendor, model};
      names.push_back(model->profile);
    }
  }
  return failure(ErrorKind::config,
                 "unknown profile '" + std::string(profile) + "'" + text::suggestion(profile, names, "profiles"));
}

}  // namespace sonar::protocol
