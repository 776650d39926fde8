// The one interface between the daemon and a vendor's wire. A vendor is a pure translator: no sockets, no clock, no log.
// The daemon owns time and bytes in flight; a Dialogue is one client's conversation, a Vendor frames pings and beacons.
#pragma once

#include <array>
#include <chrono>
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
#include <variant>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/ping.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::protocol {

using text::Ipv4;
using wire::Bytes;
using wire::BytesView;
using wire::Field;

struct Endpoint {
  Ipv4 ip{};
  std::uint16_t port = 0;
  bool operator==(const Endpoint&) const = default;
};

/// One named choice of a protocol's unknowns, settable under `options:` of a sonar in the configuration.
struct Option {
  std::string_view name;
  std::vector<std::string_view> allowed;  // first = default; empty = a number above 0, or the word of default_value
  std::string_view default_value;
  std::string_view meaning;
  double lowest = 0, highest = 0;  // of a number, inclusive; 0, 0 = any above 0
  std::string_view word = {};      // that may stand for a number, beside the default
};
/// "number above 0", "number from 5 to 170".
inline std::string numbers_of(const Option& option) {
  if (option.highest <= 0) return "number above 0";
  char text[64];
  std::snprintf(text, sizeof text, "number from %g to %g", option.lowest, option.highest);
  return text + (option.word.empty() ? "" : ", or " + std::string(option.word));
}
using OptionValues = std::map<std::string, std::string>;

/// The emulated device as its own packets describe it. Owned by the daemon's Device; read on the I/O thread only.
struct DeviceState {
  std::string name;
  std::uint16_t id = 0;  // serial number, never 0
  std::shared_ptr<const SonarModel> model;
  Ipv4 advertise_ip{}, netmask{255, 255, 255, 0};
  Ipv4 connected_client{};  // 0.0.0.0 without a client
  std::array<std::uint8_t, 6> mac{};
  Time powered_up_at{};
  Water water;  // at the device, as measured by its sensors
  double depth_m = 0;
  OptionValues options;                            // complete: defaults filled in by check_options
  std::shared_ptr<const VendorSettings> settings;  // now; null = Vendor::initial_settings
  std::uint32_t last_ping = 0;                     // number of the ping that was fired last
  Time framed_at{};                                // stamp of the ping that was framed before; Time{} = there is none
  std::chrono::nanoseconds skipped{0};             // by which stamps of pings are ahead of the time that dialogues are told
  bool simulated_time = false;                     // it may stop while clients wait
  struct StoredAddress {                           // what a client wrote; stored, never applied
    std::uint32_t ip = 0, netmask = 0;
    bool dhcp = false;
  } stored_address;
};

/// Where the device sends the datagrams of its pings from now on. Requested in a conversation: the list is that connection's,
/// beside those of others, and ends with it. Requested by a datagram or over HTTP: the device's own list, which replaces
/// Port::group.
struct SetReceivers {
  std::vector<Endpoint> to;  // address 0.0.0.0 = that of the host which requests it
  std::size_t stream = 0;    // which of the vendor's ports of kind udp_stream, counted from 0
};
/// The client replaced the device's settings, perhaps by the same ones: some drivers repeat them at ping rate.
struct ChangeSettings {
  PingSettings settings;
  std::shared_ptr<const VendorSettings> vendor_settings;
  std::string summary;                         // for the log: "mode 2, range 20 m, gain 50 %, gamma 127, rate 10 Hz, ..."
  std::optional<SetReceivers> receivers = {};  // the device's own list, where it is one of the settings
};
/// Settings override, from the control protocol or of a fault. Unset fields keep their value; all values must be finite.
struct SettingsOverride {
  std::optional<double> range_m, rate_hz, gain_percent;  // rate 0 = standby; gain 0 to 100 of what a client can turn it
  std::optional<std::uint32_t> mode, beams;              // mode: index into SonarModel::modes
  std::optional<std::uint32_t> sample_bits = {};
  std::optional<bool> row_gains = {};
};
struct RequestPing {   // one ping now (network trigger, BlueView)
  bool joins = false;  // a ping that is under way already will do
  /// Of a mechanical scan: the ping is fired with the sonar turned so far to port about its own z axis, and framed with `with` in
  /// place of the device's settings. Both hold until the next request.
  double head_rad = 0;
  std::shared_ptr<const VendorSettings> with = nullptr;
};
struct StoreAddress {
  DeviceState::StoredAddress address;
};
struct Notice {  // worth one (rate-limited) log line, e.g. junk skipped or a request refused
  std::string text;
};
struct Close {
  std::string why;
};
using Event = std::variant<ChangeSettings, RequestPing, StoreAddress, SetReceivers, Notice, Close>;
struct Reaction {
  std::vector<Event> events;
  std::vector<Bytes> replies;  // whole messages, in order
};

/// How one client gets a ping of the device: a message for each prefix, the prefix and then the bytes that all clients share.
struct Delivery {
  std::vector<Bytes> prefixes;
  std::vector<Event> events;  // what it wants next
};

class Dialogue {
 public:
  virtual ~Dialogue() = default;
  /// Any split of the stream, any garbage. Never throws, never grows without bound.
  virtual Reaction on_bytes(BytesView received, Time now) = 0;
  /// Keep-alives and subscriptions. Called at or after next_tick(). `ping_pending`: a client has asked the device for one ping,
  /// which has not been started.
  virtual Reaction on_tick(Time now, bool ping_pending) = 0;
  virtual Time next_tick() const = 0;
  /// Time of the next ping that on_tick() will request by itself. Stepped time advances to it, but not for keep-alives alone.
  virtual std::optional<Time> next_ping_request() const { return std::nullopt; }
  /// A client that says nothing for longer has gone. By the wall's clock, whatever the time is that the dialogue is told of:
  /// clients live by theirs. Nothing: it may be silent.
  virtual std::optional<std::chrono::milliseconds> longest_silence() const { return std::nullopt; }
  /// Of one with longest_silence() by datagrams: known hosts say nothing while they get pings, so that a computer which answers
  /// for the host is as good as a word.
  virtual bool hosts_fall_silent() const { return false; }
  /// A ping was put into this client's outbox: keep-alives only fill silence.
  virtual void on_ping_queued(Time now) = 0;
  /// A ping is ready, made with `made_with` (null: the initial settings); its framed size is `shared_bytes`. Most clients take
  /// every ping as it is; where hosts request single pings, only those that requested one get it. Calls on_ping_queued itself
  /// when anything is delivered.
  virtual Delivery on_ping(const VendorSettings* made_with, std::size_t shared_bytes, Time now) {
    static_cast<void>(made_with), static_cast<void>(shared_bytes);
    on_ping_queued(now);
    return {{Bytes{}}, {}};
  }
};

/// A transport of the device. A vendor may have several of a kind, but one beacon.
struct Port {
  enum class Kind {
    tcp_stream,    // listens at `number`: one Dialogue for each connection; observers have those of the vendor's first
    udp_beacon,    // sends Vendor::beacon to `number` of the configured addresses: broadcast, multicast or hosts
    udp_answer,    // passes datagrams that arrive at `number`, broadcast ones too, to Vendor::on_datagram
    udp_stream,    // sends Vendor::datagrams of each ping from `number` (0: any; may be that of a udp_answer) to the receivers
    http,          // serves Vendor::on_http at `number`
    udp_dialogue,  // one Dialogue at `number` with the host that sent the last request; it gets Vendor::datagrams of its pings
  } kind{};
  std::uint16_t number = 0;
  std::chrono::milliseconds period{0};  // of a beacon
  bool on_change = false;               // of a beacon: also sent at once when a client comes or goes
  Endpoint group{};        // of a udp_stream: its receiver until SetReceivers, often a multicast group; port 0 = none
  bool any_group = false;  // of a udp_stream: receivers may be multicast groups that the configuration does not name
  /// Of a udp_stream: least time between two datagrams of a ping. Of a tcp_stream: pause between the parts of a ping that
  /// Vendor::datagrams gives and Vendor::frame holds one behind the other.
  std::chrono::nanoseconds gap{0};
};

/// Where a driver meets a sonar.
struct DriverAddress {
  std::string_view protocol;  // "tcp", "udp", "http", "multicast", "status": status messages, by UDP
  Endpoint at;
  bool sonar_speaks_first = false;  // else the driver does
};

/// One request for a resource of the device, its sizes already limited by the server.
struct ResourceRequest {
  std::string method, path, query, content_type, body;  // path without the query: "/api/v1/speed"
  Ipv4 from{};
};
struct ResourceReply {
  unsigned status = 200;
  std::string body;
  std::string content_type = "application/json";
  std::string allow = {};  // of 405
  std::vector<Event> events = {};
};

/// What a field of a message means, whatever a vendor calls it.
enum class FieldName {
  magic,
  source_id,
  destination_id,
  message_type,
  version,
  payload_size,
  ping_id,
  ping_status,
  frequency,
  temperature,
  pressure,
  heading,
  pitch,
  roll,
  sound_speed,
  time,
  sample_type,
  range_resolution,
  rows,
  beams,
  image_offset,
  image_size,
  message_size,
  range,
  ping_rate,
  gain,
  device_id,
  part_number,
  device_status,
  firmware,
  address,
  netmask,
  connected_address,
  mac,
};
/// The same words, in that order.
inline constexpr std::array<std::string_view, 34> field_names{
    "magic",     "source_id",   "destination_id",    "message_type", "version",       "payload_size",
    "ping_id",   "ping_status", "frequency",         "temperature",  "pressure",      "heading",
    "pitch",     "roll",        "sound_speed",       "time",         "sample_type",   "range_resolution",
    "rows",      "beams",       "image_offset",      "image_size",   "message_size",  "range",
    "ping_rate", "gain",        "device_id",         "part_number",  "device_status", "firmware",
    "address",   "netmask",     "connected_address", "mac"};
static_assert(field_names.size() == static_cast<std::size_t>(FieldName::mac) + 1);

/// The message that carries a ping, as a client receives it, prefix included; the beacon.
enum class Part { ping, beacon };
/// Of a ping: what every message begins with, the other fields, the table of the beams' directions, the samples.
enum class Region { header, metadata, bearings, image };
inline constexpr std::array<std::string_view, 4> region_names{"header", "metadata", "bearings", "image"};

class Vendor {
 public:
  virtual ~Vendor() = default;
  virtual std::string_view name() const = 0;
  virtual std::span<const std::shared_ptr<const SonarModel>> models() const = 0;
  virtual std::span<const Port> ports() const = 0;
  /// The first of that kind, or null.
  const Port* port(Port::Kind kind) const {
    for (const Port& port : ports())
      if (port.kind == kind) return &port;
    return nullptr;
  }
  virtual std::span<const Option> options() const = 0;
  virtual int default_max_clients() const = 0;
  /// The model that a device with these (complete) options emulates; asked once, when its configuration is read.
  virtual Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model,
                                                          const OptionValues& options) const = 0;
  /// What the device does before any client spoke (its stored configuration).
  virtual ChangeSettings initial_settings(const DeviceState& device) const = 0;
  /// The settings that a client of this vendor would have requested: those that hold now (DeviceState::settings) with the
  /// override applied. A refusal states what the product can do.
  virtual Result<ChangeSettings> apply_override(const SettingsOverride& wanted, const DeviceState& device) const = 0;
  /// The gain as SettingsOverride::gain_percent has it: 0 to 100 of what a client can turn it.
  virtual double gain_percent(const DeviceState& device) const = 0;
  virtual bool pings_before_first_request(const DeviceState& device) const = 0;
  /// Of a mechanical scan: the ping of that number, from 1, as a usual host requests it. Others: nothing.
  struct ScanStep {
    RequestPing aim;
    PingSettings settings;
  };
  virtual std::optional<ScanStep> scan_step(std::uint32_t number, const DeviceState& device) const {
    static_cast<void>(number), static_cast<void>(device);
    return std::nullopt;
  }
  /// Empty when the vendor has no beacon.
  virtual Bytes beacon(const DeviceState& device, Time now) const = 0;
  /// Of a port of kind udp_answer. Any bytes; each reply is one datagram to the sender.
  virtual Reaction on_datagram(const Port& port, BytesView datagram, const DeviceState& device, Time now) const {
    static_cast<void>(port), static_cast<void>(datagram), static_cast<void>(device), static_cast<void>(now);
    return {};
  }
  /// Of a port of kind http. Any path, method and body.
  virtual ResourceReply on_http(const Port& port, const ResourceRequest& request, const DeviceState& device, Time now) const {
    static_cast<void>(port), static_cast<void>(request), static_cast<void>(device), static_cast<void>(now);
    return {404, "not found\n", "text/plain"};
  }
  /// Of a port of kind udp_dialogue: whether a datagram comes from a host that speaks the protocol. Others are dropped, so that
  /// they neither open a dialogue nor take it over.
  virtual bool is_request(const Port& port, BytesView datagram) const {
    static_cast<void>(port), static_cast<void>(datagram);
    return false;
  }
  /// Of a port of kind tcp_stream or udp_dialogue. The state must outlive the dialogue.
  virtual std::unique_ptr<Dialogue> converse(const Port& port, const DeviceState& device, Time now) const = 0;
  /// Whether pings travel over TCP; else frame() returns null.
  virtual bool pings_over_tcp() const { return true; }
  /// Once per ping, shared by all connections; with the settings the ping was made with (PingRequest::vendor_settings).
  virtual std::shared_ptr<const Bytes> frame(const Ping& ping, const DeviceState& device) const = 0;
  /// Of a port of kind udp_stream with receivers, or udp_dialogue: the datagrams of a ping in order, at most 65,507 bytes each.
  /// Of one of kind tcp_stream with a gap: the parts of frame() between which it pauses.
  virtual std::vector<Bytes> datagrams(const Port& port, const Ping& ping, const DeviceState& device) const {
    static_cast<void>(port), static_cast<void>(ping), static_cast<void>(device);
    return {};
  }
  /// Where a message has this field; of an empty `message`: as in the vendor's layout with the most fields. Nothing: there is no
  /// such field, or the message is too short.
  virtual std::optional<Field> field(Part part, FieldName name, BytesView message) const {
    static_cast<void>(part), static_cast<void>(name), static_cast<void>(message);
    return {};
  }
  /// Replaces an integer that has no fixed place in its message, such as a varint, by `change` of it. False: there is no such
  /// integer; of an empty `message`: no message of that kind has it.
  virtual bool change_integer(Part part, FieldName name, const std::function<std::int64_t(std::int64_t)>& change,
                              Bytes& message) const {
    static_cast<void>(part), static_cast<void>(name), static_cast<void>(change), static_cast<void>(message);
    return false;
  }
  /// Of a ping whose fields were changed, of the same size as `before`: makes the checksums of what was changed right again.
  virtual void reseal(BytesView before, Bytes& message) const { static_cast<void>(before), static_cast<void>(message); }
  /// {offset, size} of a region. Nothing: the vendor has no such region, or the ping is too short. Of an empty `ping`: {0, 0}
  /// when the vendor has such a region.
  virtual std::optional<std::pair<std::size_t, std::size_t>> region(Region region, BytesView ping) const {
    static_cast<void>(region), static_cast<void>(ping);
    return {};
  }
};

/// Fills in defaults. Unknown names and values are errors that suggest the nearest valid one.
Result<OptionValues> check_options(const Vendor& vendor, const OptionValues& given);

/// The devices of makes() (protocol/host.hpp), in that order.
std::span<const Vendor* const> vendors();
/// The vendor and model of a profile name, or an error that suggests the nearest name.
struct Profile {
  const Vendor* vendor = nullptr;
  std::shared_ptr<const SonarModel> model;
};
Result<Profile> find_profile(std::string_view profile);

/// Of a sonar at `ip`, port by port; `status_to`: where its status messages go.
std::vector<DriverAddress> driver_addresses(const Vendor& vendor, Ipv4 ip, std::span<const Endpoint> status_to);
/// "tcp        127.0.0.2:52100            the driver speaks first"
std::string line_of(std::string_view protocol, std::string_view at, bool sonar_speaks_first);

}  // namespace sonar::protocol
