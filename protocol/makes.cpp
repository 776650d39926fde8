#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "protocol/aris/aris.hpp"
#include "protocol/aris/host.hpp"
#include "protocol/blueview/blueview.hpp"
#include "protocol/blueview/host.hpp"
#include "protocol/host.hpp"
#include "protocol/oculus/host.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/ping/host.hpp"
#include "protocol/ping/omniscan.hpp"
#include "protocol/ping/ping360.hpp"
#include "protocol/ping/surveyor.hpp"
#include "protocol/vendor.hpp"
#include "protocol/waterlinked/host.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

namespace sonar::protocol {
namespace {

std::string in_quotes(std::string_view text) { return std::string("'").append(text).append("'"); }

const Option* find_option(const Vendor& vendor, std::string_view name) {
  for (const Option& option : vendor.options())
    if (option.name == name) return &option;
  return nullptr;
}

bool is_number_of(const Option& option, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return false;
  return option.highest > 0 ? value >= option.lowest && value <= option.highest : value > 0;
}

/// Empty when the pair is fine.
std::string complaint(const Vendor& vendor, const std::string& name, const std::string& value) {
  const Option* option = find_option(vendor, name);
  if (option == nullptr) {
    std::vector<std::string_view> names;
    for (const Option& known : vendor.options()) names.push_back(known.name);
    return "unknown option " + in_quotes(name) + " of " + std::string(vendor.name()) + text::suggestion(name, names, "options");
  }
  if (option->allowed.empty()) {
    const bool fine =
        value == option->default_value || (!option->word.empty() && value == option->word) || is_number_of(*option, value);
    return fine ? "" : "option " + name + " must be a " + numbers_of(*option) + ", not " + in_quotes(value);
  }
  if (std::find(option->allowed.begin(), option->allowed.end(), value) != option->allowed.end()) return "";
  return "option " + name + " cannot be " + in_quotes(value) + text::suggestion(value, option->allowed, "values");
}

}  // namespace

Result<OptionValues> check_options(const Vendor& vendor, const OptionValues& given) {
  for (const auto& [name, value] : given)
    if (const std::string text = complaint(vendor, name, value); !text.empty()) return failure(ErrorKind::config, text);
  OptionValues complete = given;
  for (const Option& option : vendor.options()) complete.try_emplace(std::string(option.name), option.default_value);
  return complete;
}

std::span<const Make> makes() {
  static const std::array<Make, 7> all{{
      {.device = &oculus::vendor(),
       .title = "an Oculus",
       .request = "fire message",
       .remedy = "send a fire message (type 0x15)",
       .ports = oculus::host_ports,
       .host = oculus::make_host,
       .codec = oculus::codec(),
       .announced = oculus::announced},
      {.device = &blueview::vendor(),
       .title = "a BlueView sonar",
       .request = "request for a ping",
       .remedy = "send a request for a ping, or a subscription",
       .ports = blueview::host_ports,
       .host = blueview::make_host,
       .codec = blueview::codec(),
       .search = &blueview::search,
       .each_ping_requested = true},
      {.device = &aris::vendor(),
       .title = "an ARIS",
       .request = "command",
       .remedy = "send SET_FRAMESTREAM_RECEIVER and SET_ACOUSTICS",
       .ports = aris::host_ports,
       .host = aris::make_host,
       .codec = aris::codec(),
       .own_numbers = true,
       .demo_mount = RollPitchYaw{0, 40 * pi / 180, 0}},  // its window ends at 3.4 m
      {.device = &waterlinked::vendor(),
       .title = "a Sonar 3D-15",
       .request = "request",
       .remedy = "post true to /acoustics/enabled and a mode to /udp, below /api/v1/integration",
       .ports = waterlinked::host_ports,
       .host = waterlinked::make_host,
       .codec = waterlinked::codec(),
       .picture = PictureKind::range_image},
      {.device = &ping::ping360::vendor(),
       .title = "a Ping360",
       .request = "request",
       .remedy = "send auto_transmit (2602), or transducer (2601) with transmit 1",
       .ports = ping::ping360::host_ports,
       .host = ping::ping360::make_host,
       .codec = ping::ping360::codec(),
       .own_numbers = true,
       .scans = true,
       .picture = PictureKind::sweep},
      {.device = &ping::surveyor::vendor(),
       .title = "a Surveyor",
       .request = "request",
       .remedy = "send set_ping_parameters (3023) with ping_enable 1",
       .ports = ping::surveyor::host_ports,
       .host = ping::surveyor::make_host,
       .codec = ping::surveyor::codec(),
       .own_numbers = true,
       .demo_mount = RollPitchYaw{0, pi / 2, 0},  // it looks down
       .picture = PictureKind::points},
      {.device = &ping::omniscan::vendor(),
       .title = "an Omniscan",
       .request = "request",
       .remedy = "send os_ping_params (2197) with enable 1",
       .ports = ping::omniscan::host_ports,
       .host = ping::omniscan::make_host,
       .codec = ping::omniscan::codec(),
       .own_numbers = true,
       .demo_mount = RollPitchYaw{0, pi / 6, -pi / 2},  // to starboard
       .picture = PictureKind::waterfall},
  }};
  return all;
}

const Make* find_make(std::string_view name) {
  for (const Make& make : makes())
    if (make.name() == name) return &make;
  return nullptr;
}

std::vector<DriverAddress> driver_addresses(const Vendor& vendor, Ipv4 ip, std::span<const Endpoint> status_to) {
  std::vector<DriverAddress> all;
  for (const Port& port : vendor.ports()) {
    using Kind = Port::Kind;
    if (port.kind == Kind::tcp_stream) all.push_back({"tcp", {ip, port.number}});
    if (port.kind == Kind::udp_dialogue || port.kind == Kind::udp_answer) all.push_back({"udp", {ip, port.number}});
    if (port.kind == Kind::http) all.push_back({"http", {ip, port.number}});
    if (port.kind == Kind::udp_stream && port.group.port != 0) all.push_back({"multicast", port.group, true});
    if (port.kind == Kind::udp_beacon)
      for (const Endpoint& to : status_to) all.push_back({"status", to, true});
  }
  return all;
}

std::string line_of(std::string_view protocol, std::string_view at, bool sonar_speaks_first) {
  return text::format("%-10.*s %-26.*s %s speaks first", static_cast<int>(protocol.size()), protocol.data(),
                      static_cast<int>(at.size()), at.data(), sonar_speaks_first ? "the sonar" : "the driver");
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

Result<Profile> find_profile(std::string_view profile) {
  std::vector<std::string_view> names;
  for (const Vendor* vendor : vendors()) {
    for (const auto& model : vendor->models()) {
      if (model->profile == profile) return Profile{vendor, model};
      names.push_back(model->profile);
    }
  }
  return failure(ErrorKind::config, "unknown profile " + in_quotes(profile) + text::suggestion(profile, names, "profiles"));
}

}  // namespace sonar::protocol
