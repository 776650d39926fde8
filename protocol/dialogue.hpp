// One client's conversation with the emulated device, and its effects on the device. Pure: bytes and time in, replies and events
// out.
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

/// Where the device sends the datagrams of its pings from now on. Requested in a conversation: the list is that connection's,
/// beside those of others, and ends with it. Requested by a datagram or over HTTP: the device's own list, which replaces
/// Port::group.
struct SetReceivers {
  std::vector<Endpoint> to;  // address 0.0.0.0 = that of the host which requests it
  std::size_t stream = 0;    // index of the vendor's port of kind udp_stream, counted from 0
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
  std::optional<double> range_m, rate_hz, gain_percent;  // rate 0 = standby; gain: per cent of what a client can set
  std::optional<std::uint32_t> mode, beams;              // mode: index into SonarModel::modes
  std::optional<std::uint32_t> sample_bits = {};
  std::optional<bool> row_gains = {};
};
struct RequestPing {   // one ping now (network trigger, BlueView)
  bool joins = false;  // a ping that is already under way satisfies the request, too
  /// Of a mechanical scan: the ping is fired with the sonar turned so far to port about its own z axis, and framed with `with` in
  /// place of the device's settings. Both hold until the next request.
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
  /// Accepts the stream in pieces of any size, and any garbage. It never throws and never grows without bound.
  virtual Reaction on_bytes(BytesView received, Time now) = 0;
  /// Keep-alives and subscriptions. Called at or after next_tick(). `ping_pending`: a client has asked the device for one ping,
  /// which has not been started.
  virtual Reaction on_tick(Time now, bool ping_pending) = 0;
  virtual Time next_tick() const = 0;
  /// Time of the next ping that on_tick() will request by itself. Stepped time advances to it, but not for keep-alives alone.
  virtual std::optional<Time> next_ping_request() const { return std::nullopt; }
  /// A client that sends nothing for longer is disconnected. Counted in wall time, because clients run in wall time even if the
  /// time of on_bytes() and on_tick() is simulated. nullopt: no limit.
  virtual std::optional<std::chrono::milliseconds> longest_silence() const { return std::nullopt; }
  /// Whether known hosts send nothing while they get pings. Then, with longest_silence() and datagrams, an answer of the host's
  /// computer counts as a message of the host.
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

}  // namespace sonar::protocol
