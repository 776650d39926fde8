#include <algorithm>
#include <array>
#include <cstdio>

#include "core/text/ipv4.hpp"
#include "protocol/awaited_ping.hpp"
#include "protocol/ping/conversation.hpp"
#include "protocol/ping/locate.hpp"
#include "protocol/ping/ping360_settings.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping::ping360 {
namespace {

using protocol::Reaction;

DeviceInformation identity(const protocol::OptionValues& options) {
  DeviceInformation info;
  info.type = static_cast<std::uint8_t>(number_option(options, sonar::ping::option_name::device_type));
  int major = 0, minor = 0, patch = 0;
  std::sscanf(std::string(text_option(options, option_name::firmware)).c_str(), "%d.%d.%d", &major, &minor, &patch);
  info.major = static_cast<std::uint8_t>(major);
  info.minor = static_cast<std::uint8_t>(minor);
  info.patch = static_cast<std::uint8_t>(patch);
  return info;
}

/// The dialogue with one host. A request starts a task (`Task`), which replaces the task in progress. Each ping of a task has two
/// waits: until the head has turned (`due_`), then until the ping is computed (`awaited_`). on_tick() ends the first wait,
/// on_ping() the second.
class Ping360Dialogue final : public Conversation {
 public:
  Ping360Dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : Conversation(device, port, identity(device.options), Settings{}.id), head_{0, 0, now} {}

  Reaction on_tick(Time now, bool ping_pending) override {
    Reaction reaction;
    if (now < next_tick()) return reaction;
    if (awaited_.is_under_way()) {
      if (awaited_.lose(ping_pending, now)) advance(now);  // the scan continues without the late ping
      return reaction;
    }
    Settings s = settings();
    s.id = id_;
    s.ping.angle = head_.target();
    // The head has reached its angle. The answer to a request without transmission is device_data (2300) without samples.
    if (task_ == Task::turn) {
      reaction.replies.push_back(state_message(now));
      task_ = Task::none;
      return reaction;
    }
    const auto with = std::make_shared<const HeldSettings>(s);
    awaited_.begin(with, now);
    reaction.events.emplace_back(
        protocol::RequestPing{.joins = false, .head_rad = ping360::head_rad(s.ping.angle, device_.options), .with = with});
    return reaction;
  }
  Time next_tick() const override {
    if (task_ == Task::none) return Time::max();
    return awaited_.is_under_way() ? awaited_.lost_at() : due_;
  }
  std::optional<Time> next_ping_request() const override {
    return task_ != Task::none && !awaited_.is_under_way() ? std::optional(due_)
                                                           : std::nullopt;  // stepped time also stops at the end of a turn
  }
  bool hosts_fall_silent() const override { return task_ != Task::none; }  // ping-python sends nothing while it scans
  protocol::Delivery on_ping(const VendorSettings* made_with, std::size_t, Time now) override {
    const auto arrival = awaited_.arrive(made_with);
    if (arrival == protocol::AwaitedPing::Arrival::other) return {};
    if (arrival == protocol::AwaitedPing::Arrival::awaited) advance(now);
    return {{Bytes{}}, {}};
  }

 protected:
  /// transducer (2601) and auto_transmit (2602) begin a task, whose messages are the answer; other requests are acknowledged.
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    switch (frame.header.id) {
      case Id::transducer: {
        Transducer t;
        if (read(frame, t, reaction)) begin(frame, t, now, reaction);
        return true;
      }
      case Id::auto_transmit: {
        AutoTransmit t;
        if (read(frame, t, reaction)) begin(frame, t, now, reaction);
        return true;
      }
      case Id::motor_off:
        stop(now);
        reaction.replies.push_back(ack(frame.header.id, id_));
        return true;
      case Id::reset:
        stop(now);
        reaction.events.emplace_back(change_to(Settings{}, device_));
        reaction.replies.push_back(ack(frame.header.id, id_));
        return true;
      case Id::ping360_set_device_id:
        set_id(frame, reaction);
        return true;
      default:
        return false;
    }
  }

  Bytes message_now(Id wanted, Time now) override { return wanted == Id::device_data ? state_message(now) : Bytes{}; }

 private:
  /// turn: turns the head, then sends device_data (2300) without samples. ping: turns the head, then fires one ping. scan: pings
  /// and turns until another request.
  enum class Task { none, turn, ping, scan };

  Settings settings() const { return settings_from(device_.settings.get()); }

  /// Makes device_data (2300) without samples: the settings and the present angle of the head.
  Bytes state_message(Time now) const {
    const Transducer t = settings().ping;
    return framed_message(Id::device_data, id_,
                          DeviceData{t.mode, t.gain, head_.angle_at(now), t.transmit_us, t.period, t.khz, t.samples, 0});
  }

  /// Begins the task of a valid request, which replaces the task in progress. A refused request has no effect.
  template <class Request>
  void begin(const Frame& frame, const Request& request, Time now, Reaction& reaction) {
    if (const std::string why = complaint(request); !why.empty()) return refuse(frame, why, reaction);
    const Settings s = settings_of(request);
    stop(now);
    task_ = s.scans ? Task::scan : s.ping.transmit != 0 ? Task::ping : Task::turn;
    back_ = false;
    head_.turn_to(s.ping.angle, now);
    due_ = head_.arrives();
    reaction.events.emplace_back(change_to(s, device_));
  }

  /// Stops the head at once, also during a turn. A ping that still arrives is not sent.
  void stop(Time now) {
    task_ = Task::none;
    awaited_.forget();
    head_ = {head_.angle_at(now), head_.angle_at(now), now};
  }

  /// Ends the ping that was awaited. The next ping of a scan is due after the samples have been taken and sent, and the head has
  /// turned.
  void advance(Time now) {
    if (task_ != Task::scan) {
      task_ = Task::none;
      return;
    }
    const Settings s = settings();
    const auto after = listening(s.ping) + transfer(s.ping, device_.options) + std::chrono::milliseconds(s.delay_ms);
    const Time turns_at = awaited_.fired_at() + after;
    const bool oscillates = text_option(device_.options, option_name::sector_scan) != "wrap";
    head_.turn_to(next_angle(head_.target(), s, back_, oscillates), turns_at);
    // After a late ping the scan does not catch up; the next ping is due now at the earliest.
    due_ = std::max(head_.arrives(), now);
  }

  Head head_;
  Task task_ = Task::none;
  bool back_ = false;  // true: an oscillating scan returns to the start angle
  Time due_{};
  protocol::AwaitedPing awaited_;
};

using PortKind = protocol::Port::Kind;
constexpr std::uint16_t data_port = 12345, discovery_port = 30303;
constexpr std::array<protocol::Port, 2> port_table{
    {{.kind = PortKind::udp_dialogue, .number = data_port, .carries = "settings, scan lines"},
     {.kind = PortKind::udp_answer, .number = discovery_port, .carries = "discovery"}}};

std::string text_of(protocol::BytesView bytes) {
  std::string text;
  for (const std::byte b : bytes) text += static_cast<char>(std::to_integer<unsigned char>(b));
  return text;
}

/// Makes the answer to "Discovery": four lines that end with CR LF, in one datagram to the requesting host. The numbers of the
/// address have three digits.
protocol::Bytes discovery_answer(const protocol::DeviceState& device) {
  const auto& m = device.mac;
  const auto& ip = device.advertise_ip;
  char text[160];
  const int size = std::snprintf(
      text, sizeof text,
      "PING360\r\nBlue Robotics\r\nMAC Address:- %02X-%02X-%02X-%02X-%02X-%02X\r\nIP Address:- %03d.%03d.%03d.%03d\r\n", m[0],
      m[1], m[2], m[3], m[4], m[5], ip[0], ip[1], ip[2], ip[3]);
  protocol::Bytes bytes;
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::byte>(text[i]));
  return bytes;
}

/// Returns the address in a text such as "SetSS1IP 192.168.002.010". An address of zeros selects DHCP.
std::optional<protocol::StoredAddress> address_in(const std::string& text) {
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (std::sscanf(text.c_str(), "SetSS1IP %3u.%3u.%3u.%3u", &a, &b, &c, &d) != 4 || std::max({a, b, c, d}) > 255) return {};
  const protocol::Ipv4 ip{static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(c),
                          static_cast<std::uint8_t>(d)};
  return protocol::StoredAddress{.ip = text::number_from_ipv4(ip), .netmask = 0, .dhcp = ip == protocol::Ipv4{}};
}

class Ping360Vendor final : public protocol::VendorWith<models, ping360::apply_override, locate_ping360, locate_ping360> {
 public:
  std::string_view name() const override { return "ping360"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return ping360::options(); }
  int default_max_clients() const override { return 1; }  // the only client is the last sender
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override {
    return change_to(Settings{}, device);
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 50.0 * settings_from(device.settings.get()).ping.gain;
  }
  protocol::PingsBy pings_by() const override { return protocol::PingsBy::datagrams; }
  /// Scans the half circle ahead, back and forth, with a range of 10 m unless a host or the configuration has set another.
  std::optional<ScanStep> scan_step(std::uint32_t number, const protocol::DeviceState& device) const override {
    Settings s = settings_from(device.settings.get());
    if (HeldSettings(s).equals(HeldSettings(Settings{})))
      if (const auto usual =
              ping360::apply_override({.range_m = 10, .rate_hz = {}, .gain_percent = {}, .mode = {}, .beams = {}}, device))
        s = settings_from(usual->vendor_settings.get());
    constexpr std::uint32_t half = grads / 2;
    const std::uint32_t place = (number - 1) % grads;
    s.ping.angle = static_cast<std::uint16_t>((grads - half / 2 + std::min(place, grads - place)) % grads);
    s.ping.transmit = 1;
    return ScanStep{{.head_rad = head_rad(s.ping.angle, device.options), .with = std::make_shared<HeldSettings>(s)},
                    ping_settings(s, device)};
  }
  bool is_request(const protocol::Port&, protocol::BytesView datagram) const override { return holds_frame(datagram); }
  /// Handles the text protocol of the discovery port. SetSS1IP changes the address of a real device; here it is only stored.
  protocol::Reaction on_datagram(const protocol::Port&, protocol::BytesView datagram, const protocol::DeviceState& device,
                                 Time) const override {
    protocol::Reaction reaction;
    const std::string text = text_of(datagram);
    if (text.starts_with("Discovery")) reaction.replies.push_back(discovery_answer(device));
    if (const auto address = address_in(text)) reaction.events.emplace_back(protocol::StoreAddress{*address});
    return reaction;
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return std::make_unique<Ping360Dialogue>(device, port, now);
  }
  std::vector<protocol::Bytes> datagrams(const protocol::Port&, const Ping& ping, const protocol::DeviceState&) const override {
    return {encode(settings_from(ping.request.vendor_settings.get()), ping.samples)};
  }
  void reseal(protocol::BytesView before, protocol::Bytes& ping) const override { sonar::ping::reseal(before, ping); }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<Ping360Vendor>(); }

}  // namespace sonar::ping::ping360
