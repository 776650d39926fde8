#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "protocol/host.hpp"
#include "protocol/vendor.hpp"

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
  if (option.whole && std::trunc(value) != value) return false;
  return option.highest > 0 ? value >= option.lowest && value <= option.highest : value > 0;
}

/// The reason if the option or its value is refused, else an empty text.
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
  return text::format("%-10.*s %-26.*s %s", static_cast<int>(protocol.size()), protocol.data(), static_cast<int>(at.size()),
                      at.data(), sonar_speaks_first ? "sends without a request" : "waits for the driver");
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

// If two makes have a profile of the same name, the first is taken, as by make_of_profile().
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
