// The interface between an emulated sonar and a vendor's protocol. A Vendor encodes pings and beacons; its Dialogues communicate
// with clients. They use no sockets, clock or log; the daemon has the time and the send buffers.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/dialogue.hpp"
#include "protocol/message_fields.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::protocol {

// The ports of an emulated device, and requests over HTTP.

/// A port of the device. A vendor may have several ports of a kind, but only one beacon.
struct Port {
  enum class Kind {
    tcp_stream,    // listens at `number`; each connection has a Dialogue; observers use the vendor's first such port
    udp_beacon,    // sends Vendor::beacon to `number` of the configured addresses: broadcast, multicast or hosts
    udp_answer,    // passes datagrams that arrive at `number`, including broadcasts, to Vendor::on_datagram
    udp_stream,    // sends Vendor::datagrams of each ping from `number` (0: any; may equal that of a udp_answer) to the receivers
    http,          // serves Vendor::on_http at `number`
    udp_dialogue,  // has one Dialogue at `number`, with the host that sent the last request, which gets Vendor::datagrams
  } kind{};
  std::uint16_t number = 0;
  std::string_view carries = {};        // text for users about the data at this port, such as "settings, pings"
  bool has_pings = true;                // tcp_stream: false = its connections get no pings, only answers to commands
  std::chrono::milliseconds period{0};  // period of a beacon
  bool on_change = false;               // true: the beacon is also sent when a client connects or leaves
  Endpoint group{};                     // receiver of a udp_stream until SetReceivers, often a multicast group; port 0 = none
  bool any_group = false;               // true: receivers of a udp_stream may be groups that are not in the configuration
  /// udp_stream: shortest time between two datagrams of a ping. tcp_stream: pause between the parts of a ping;
  /// Vendor::datagrams returns the parts, Vendor::frame the whole.
  std::chrono::nanoseconds gap{0};
};

/// An address at which a driver connects to a sonar.
struct DriverAddress {
  std::string_view protocol;  // "tcp", "udp", "http", "multicast", "status": status messages, over UDP
  Endpoint at;
  std::string_view carries;         // equals Port::carries
  bool sonar_speaks_first = false;  // false: the driver sends first
};

/// One request for a resource of the device. The server has limited its sizes.
struct ResourceRequest {
  std::string method, path, query, content_type, body;  // path without the query: "/api/v1/speed"
  Ipv4 from{};
};
struct ResourceReply {
  unsigned status = 200;
  std::string body;
  std::string content_type = "application/json";
  std::string allow = {};  // Allow header of status 405
  std::vector<Event> events = {};
};

// Options of a sonar in the configuration: the options of a make, and their values; check_options() adds the defaults.

/// A property that no source states; users set it under `options:` of a sonar in the configuration.
struct Option {
  std::string_view name;
  std::vector<std::string_view> allowed;  // the first is the default; empty = a number, `word` or the default
  std::string_view default_value;
  std::string_view meaning;
  double lowest = 0, highest = 0;  // limits of a number, inclusive
  std::string_view word = {};      // word that is allowed in addition to numbers and the default
  bool whole = false;              // the number has no fraction
};
/// Returns a text such as "number from 5 to 170" or "whole number from 0 to 255".
inline std::string numbers_of(const Option& option) {
  const std::string kind = option.whole ? "whole number" : "number";
  char text[64];
  std::snprintf(text, sizeof text, " from %.9g to %.9g", option.lowest, option.highest);
  return kind + text + (option.word.empty() ? "" : ", or " + std::string(option.word));
}
using OptionValues = std::map<std::string, std::string>;

inline std::string_view text_option(const OptionValues& values, std::string_view name) {
  const auto found = values.find(std::string(name));
  return found == values.end() ? std::string_view{} : std::string_view(found->second);
}

/// Returns the option's number; nullopt if it is a word.
inline std::optional<double> given_number(const OptionValues& values, std::string_view name) {
  const std::string_view text = text_option(values, name);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
  return is_number ? std::optional(value) : std::nullopt;
}

/// Returns the option's number, or 0 if it is a word.
inline double number_option(const OptionValues& values, std::string_view name) { return given_number(values, name).value_or(0); }

using wire::Field;

/// The state of the emulated device that its messages describe. The daemon's Device owns it; only the I/O thread reads it.
struct DeviceState {
  std::string name;
  std::uint16_t id = 0;  // serial number, never 0
  std::shared_ptr<const SonarModel> model;
  Ipv4 advertise_ip{}, netmask{255, 255, 255, 0};
  Ipv4 connected_client{};  // 0.0.0.0 without a client
  std::array<std::uint8_t, 6> mac{};
  Time powered_up_at{};
  Water water;  // water at the device, as its sensors measure it
  double depth_m = 0;
  OptionValues options;                            // all options, with the defaults that check_options adds
  std::shared_ptr<const VendorSettings> settings;  // present settings; null = Vendor::initial_settings
  std::uint32_t last_ping = 0;                     // number of the last fired ping
  Time framed_at{};                                // stamp of the previously framed ping; Time{} = none
  std::chrono::nanoseconds skipped{0};             // stamps of pings minus the time of the dialogues
  bool simulated_time = false;                     // true: time may stop while clients wait
  StoredAddress stored_address;
};

/// The transport of pings to a host: a TCP connection, datagrams (frame() returns null), or that of the host's requests.
enum class PingsBy { stream, datagrams, either };

/// The distance that a range finder, such as an altimeter, measures with one ping.
struct Distance {
  double range_m = 0;          // range that the device computes
  int confidence_percent = 0;  // 0 = no echo was found
};

class Vendor {
 public:
  virtual ~Vendor() = default;
  virtual std::string_view name() const = 0;
  virtual std::span<const std::shared_ptr<const SonarModel>> models() const = 0;
  virtual std::span<const Port> ports() const = 0;
  /// Returns the first port of that kind, or null.
  const Port* port(Port::Kind kind) const {
    for (const Port& port : ports())
      if (port.kind == kind) return &port;
    return nullptr;
  }
  /// True if several TCP ports each send different bytes of a ping.
  bool has_several_streams() const { return std::ranges::count(ports(), Port::Kind::tcp_stream, &Port::kind) > 1; }
  virtual std::span<const Option> options() const { return {}; }
  virtual int default_max_clients() const = 0;
  /// Returns the model that a device with these (complete) options emulates. Called once, when its configuration is read.
  virtual Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model,
                                                          const OptionValues& /*options*/) const {
    return model;
  }
  /// Returns the settings before any client has sent settings (the device's stored configuration).
  virtual ChangeSettings initial_settings(const DeviceState& device) const = 0;
  /// Applies the override to the present settings (DeviceState::settings), as a client of this vendor would. The error states the
  /// product's limits.
  virtual Result<ChangeSettings> apply_override(const SettingsOverride& wanted, const DeviceState& device) const = 0;
  /// Returns the present gain, in the unit of SettingsOverride::gain_percent: per cent of the range that a client can set.
  virtual double gain_percent(const DeviceState& device) const = 0;
  virtual bool pings_before_first_request(const DeviceState& /*device*/) const { return false; }
  /// True if the settings last until the device restarts; false if they last until the last client leaves, so that the next
  /// client gets the initial settings.
  virtual bool keeps_settings() const { return false; }
  /// Returns changes that the device makes after a ping, such as an automatic range; nullopt = no change.
  virtual std::optional<ChangeSettings> after_ping(const Ping& /*ping*/, const DeviceState& /*device*/) const {
    return std::nullopt;
  }
  /// True if the sonars are range finders, which measure one distance with each ping.
  virtual bool measures_distance() const { return false; }
  /// Returns the distance in a ping that the device reports; nullopt if the sonar is not a range finder.
  virtual std::optional<Distance> distance_in(const Ping& /*ping*/) const { return std::nullopt; }
  /// The request of a usual host for one ping of a mechanical scan.
  struct ScanStep {
    RequestPing aim;
    PingSettings settings;
  };
  /// Returns the request for ping `number`, counted from 1; nullopt if the sonar does not scan.
  virtual std::optional<ScanStep> scan_step(std::uint32_t /*number*/, const DeviceState& /*device*/) const {
    return std::nullopt;
  }
  /// Returns the beacon's datagram; empty if the vendor has no beacon.
  virtual Bytes beacon(const DeviceState& /*device*/, Time /*now*/) const { return {}; }
  /// Answers a datagram with any content at a port of kind udp_answer; each reply is one datagram to the sender.
  virtual Reaction on_datagram(const Port& /*port*/, BytesView /*datagram*/, const DeviceState& /*device*/, Time /*now*/) const {
    return {};
  }
  /// Answers a request with any path, method and body at a port of kind http.
  virtual ResourceReply on_http(const Port& /*port*/, const ResourceRequest& /*request*/, const DeviceState& /*device*/,
                                Time /*now*/) const {
    return {404, "not found\n", "text/plain"};
  }
  /// True if a datagram at a port of kind udp_dialogue has the vendor's protocol. Other datagrams are dropped, so that they
  /// neither open a dialogue nor take it over.
  virtual bool is_request(const Port& /*port*/, BytesView /*datagram*/) const { return false; }
  /// Makes a new dialogue at a port of kind tcp_stream or udp_dialogue. `device` must outlive it.
  virtual std::unique_ptr<Dialogue> converse(const Port& port, const DeviceState& device, Time now) const = 0;
  virtual PingsBy pings_by() const { return PingsBy::stream; }
  /// Returns the time at which the device sends a ping's messages, if it needs time to make them; nullopt = at once.
  virtual std::optional<Time> leaves_at(const Ping& /*ping*/, const DeviceState& /*device*/) const { return std::nullopt; }
  /// Encodes a ping with its settings (PingRequest::vendor_settings), for all connections, or for those of the first of several
  /// TCP ports. Called once per ping. Returns null if pings are datagrams, or consist of the parts of several TCP ports.
  virtual std::shared_ptr<const Bytes> frame(const Ping& /*ping*/, const DeviceState& /*device*/) const { return nullptr; }
  /// Returns the datagrams of a ping in order, at most 65,507 bytes each, for a port of kind udp_stream with receivers, or
  /// udp_dialogue. For a port of kind tcp_stream, returns the parts of frame(), between which the device pauses; with several
  /// such ports, the bytes of this port.
  virtual std::vector<Bytes> datagrams(const Port& /*port*/, const Ping& /*ping*/, const DeviceState& /*device*/) const {
    return {};
  }
  /// Returns the place of a field in a message; if `message` is empty, in the vendor's layout with the most fields. Returns
  /// nullopt if the message has no such field or is too short.
  virtual std::optional<Field> field(Part /*part*/, FieldName /*name*/, BytesView /*message*/) const { return {}; }
  /// Replaces an integer without a fixed offset in the message, such as a varint, with `change(integer)`. Returns false if the
  /// message has no such integer; for an empty `message`, returns false if no message of this kind has one.
  virtual bool change_integer(Part /*part*/, FieldName /*name*/, const std::function<std::int64_t(std::int64_t)>& /*change*/,
                              Bytes& /*message*/) const {
    return false;
  }
  /// Corrects the checksums of a ping whose fields were changed. `before`: the unchanged ping, of the same size.
  virtual void reseal(BytesView /*before*/, Bytes& /*message*/) const {}
  /// Returns {offset, size} of a region of a ping; nullopt if the vendor has no such region, or if the ping is too short. For an
  /// empty `ping` it is {0, 0} if the vendor has such a region.
  virtual std::optional<std::pair<std::size_t, std::size_t>> region(Region /*region*/, BytesView /*ping*/) const { return {}; }
};

/// Returns the models of a make with one product. `make` is called once.
template <SonarModel (*make)()>
std::span<const std::shared_ptr<const SonarModel>> only_model() {
  static const std::shared_ptr<const SonarModel> model = std::make_shared<const SonarModel>(make());
  return {&model, 1};
}

/// Returns the device of a make. `T` is made once.
template <class T>
const Vendor& only_vendor() {
  static const T only;
  return only;
}

/// A device whose make has these functions: models(), apply_override(), and, for faults, locate() for the fields and regions of
/// a ping (null: there are none).
template <auto models_of, auto override_of, std::optional<Field> (*field_of)(FieldName, BytesView) = nullptr,
          std::optional<std::pair<std::size_t, std::size_t>> (*region_of)(Region, BytesView) = nullptr, class Base = Vendor>
class VendorWith : public Base {
 public:
  using Base::Base;
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return models_of(); }
  Result<ChangeSettings> apply_override(const SettingsOverride& wanted, const DeviceState& device) const override {
    return override_of(wanted, device);
  }
  std::optional<Field> field(Part part, FieldName name, BytesView message) const override {
    if constexpr (field_of != nullptr)
      if (part == Part::ping) return field_of(name, message);
    return {};
  }
  std::optional<std::pair<std::size_t, std::size_t>> region(Region region, BytesView ping) const override {
    if constexpr (region_of != nullptr) return region_of(region, ping);
    return {};
  }
};

/// A sonar that sends pings without a request, from power-up on, to every client of one TCP port.
class PushingVendor : public Vendor {
 public:
  explicit PushingVendor(std::uint16_t tcp_port)
      : ports_{{{.kind = Port::Kind::tcp_stream, .number = tcp_port, .carries = "pings"}}} {}
  std::span<const Port> ports() const override { return ports_; }
  int default_max_clients() const override { return 4; }  // assumed, because no source states it
  bool pings_before_first_request(const DeviceState&) const override { return true; }

 private:
  std::array<Port, 1> ports_;
};

/// Checks options and adds the defaults of missing options. Unknown names and values are errors that suggest the nearest valid
/// one.
Result<OptionValues> check_options(const Vendor& vendor, const OptionValues& given);

/// Returns the devices of makes() (protocol/host.hpp), in that order.
std::span<const Vendor* const> vendors();
/// The vendor and model of a profile name.
struct Profile {
  const Vendor* vendor = nullptr;
  std::shared_ptr<const SonarModel> model;
};
/// Finds a profile. The error suggests the nearest name.
Result<Profile> find_profile(std::string_view profile);

/// Returns the addresses of a sonar at `ip`, port by port. `status_to`: the receivers of its status messages; port 0 = the port
/// of the vendor.
std::vector<DriverAddress> driver_addresses(const Vendor& vendor, Ipv4 ip, std::span<const Endpoint> status_to);
/// Returns a line such as "tcp        127.0.0.2:52100            settings, pings; waits for the driver".
std::string line_of(std::string_view protocol, std::string_view at, std::string_view carries, bool sonar_speaks_first);

}  // namespace sonar::protocol
