// The dialogue of one client with the emulated device. Its inputs are bytes and times; it returns replies to the client, and
// events for the device.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/sonar/ping.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::protocol {

using text::Ipv4;
using wire::Bytes;
using wire::BytesView;

struct Endpoint {
  Ipv4 ip{};
  std::uint16_t port = 0;
  bool operator==(const Endpoint&) const = default;
};

/// Sets the receivers of ping datagrams. A request on a client's connection sets a list that ends with the connection;
/// other connections have their own lists. A request over UDP or HTTP sets the device's list, which replaces Port::group.
struct SetReceivers {
  std::vector<Endpoint> to;  // address 0.0.0.0 = the requesting host
  std::size_t stream = 0;    // index of the vendor's port of kind udp_stream, counted from 0
};
/// Replaces the device's settings. They may equal the present settings, because some drivers repeat them for every ping.
struct ChangeSettings {
  PingSettings settings;
  std::shared_ptr<const VendorSettings> vendor_settings;
  std::string summary;                         // text for the log, such as "mode 2, range 20 m, gain 50 %, gamma 127, ..."
  std::optional<SetReceivers> receivers = {};  // the device's list, if the settings contain it
};
/// Settings that the control interface or a fault changes, in terms that all makes share. Unset fields keep their value; all
/// values must be finite.
struct SettingsOverride {
  std::optional<double> range_m, rate_hz, gain_percent;  // rate 0 = standby; gain: per cent of what a client can set
  std::optional<std::uint32_t> mode, beams;              // mode: index into SonarModel::modes
  std::optional<std::uint32_t> sample_bits = {};
  std::optional<bool> row_gains = {};
};
/// Requests one ping now.
struct RequestPing {
  bool joins = false;  // true: a ping that is already being computed also serves the request
  /// For a mechanical scan: the ping is fired with the sonar rotated to port by `head_rad` about its z axis, and framed with the
  /// settings `with`, which replace the device's. Both values apply until the next request.
  double head_rad = 0;
  std::shared_ptr<const VendorSettings> with = nullptr;
};
/// The device's address as a client wrote it; stored, never applied.
struct StoredAddress {
  std::uint32_t ip = 0, netmask = 0;
  bool dhcp = false;
};
struct StoreAddress {
  StoredAddress address;
};
/// A line for the log, for example about skipped bytes or a refused request. The log limits the rate of such lines.
struct Notice {
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

/// The messages that deliver a ping to one client: one for each prefix. A message is the prefix followed by the bytes that all
/// clients share.
struct Delivery {
  std::vector<Bytes> prefixes;
  std::vector<Event> events;  // events that follow from the delivery, such as the request of the next ping
};

class Dialogue {
 public:
  virtual ~Dialogue() = default;
  /// Reads the stream in pieces of any size, with any content. It never throws, and limits the bytes that it keeps.
  virtual Reaction on_bytes(BytesView received, Time now) = 0;
  /// Does what is due, such as keep-alives and pings of a subscription. Called at or after next_tick(). `ping_pending`: true if a
  /// client has requested a ping whose computation has not begun.
  virtual Reaction on_tick(Time now, bool ping_pending) = 0;
  virtual Time next_tick() const = 0;
  /// Returns the time of the next ping that on_tick() will request without input. Stepped time advances to this time, but not to
  /// keep-alives.
  virtual std::optional<Time> next_ping_request() const { return std::nullopt; }
  /// Returns the time after which a silent client is disconnected; nullopt = no limit. It is wall time, because clients run in
  /// wall time even if the time of on_bytes() and on_tick() is simulated.
  virtual std::optional<std::chrono::milliseconds> longest_silence() const { return std::nullopt; }
  /// True if known hosts are silent while they receive pings. Then, over UDP, an answer of the host's computer also ends a
  /// silence.
  virtual bool hosts_fall_silent() const { return false; }
  /// Called when a ping was put into this client's outbox; it postpones the keep-alive.
  virtual void on_ping_queued(Time now) = 0;
  /// Called when a ping is ready. `made_with`: the settings of the ping (null: the initial ones); `shared_bytes`: its framed
  /// size. In most protocols every client gets every ping; in protocols with requests for single pings, only clients that
  /// requested the ping get it. It calls on_ping_queued() if the client gets the ping.
  virtual Delivery on_ping(const VendorSettings* /*made_with*/, std::size_t /*shared_bytes*/, Time now) {
    on_ping_queued(now);
    return {{Bytes{}}, {}};
  }
};

}  // namespace sonar::protocol
