// The dialogue that all devices of the family share: frames, identity, device ids. A product adds its own requests.
#pragma once

#include <array>
#include <string_view>

#include "protocol/held_settings.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping {

using protocol::number_option;
using protocol::text_option;

/// Options of every product.
namespace option_name {
inline constexpr std::string_view device_type = "device_type", silence_s = "host_silence_s";
}
protocol::Option silence_option();
protocol::Option type_option(std::string_view usual, std::string_view meaning);

class Conversation : public protocol::Dialogue {
 public:
  /// `device` must outlive the object. At a port of kind udp_dialogue, frames do not continue in the next datagram.
  Conversation(const protocol::DeviceState& device, const protocol::Port& port, DeviceInformation identity, std::uint8_t id)
      : device_(device),
        by_datagrams_(port.kind == protocol::Port::Kind::udp_dialogue),
        id_(id),
        identity_(identity),
        framer_(longest_request, by_datagrams_) {}

  protocol::Reaction on_bytes(protocol::BytesView received, Time now) final;
  std::optional<std::chrono::milliseconds> longest_silence() const override;
  void on_ping_queued(Time) override {}

 protected:
  /// Handles a request with a valid checksum. Returns false if the product has no such request.
  virtual bool on_request(const Frame& frame, Time now, protocol::Reaction& reaction) = 0;
  /// Returns the product's message `wanted` with the present values; empty if the product has no such message.
  virtual Bytes message_now(Id wanted, Time now) = 0;
  /// True if the message is sent with every ping and pings are enabled, so that the next ping answers the request for it.
  virtual bool comes_with_pings(Id) const { return false; }
  /// Answers the request for this message in the product's own way and returns true; else returns false.
  virtual bool on_wanted(Id /*wanted*/, Time /*now*/, protocol::Reaction& /*reaction*/) { return false; }
  /// Called when a host has set id_.
  virtual void on_new_id(protocol::Reaction&) {}

  /// Reads the payload of a request as a message. If it is too short, refuses the request and returns false.
  template <class M>
  bool read(const Frame& frame, M& message, protocol::Reaction& reaction) const {
    wire::Reader reader(frame.payload);
    fields(reader, message);
    if (!reader.ok()) refuse(frame, reader.failure_text(), reaction);
    return reader.ok();
  }
  void refuse(const Frame& frame, const std::string& why, protocol::Reaction& reaction) const;
  void set_id(const Frame& frame, protocol::Reaction& reaction);
  /// Answers a request for a message.
  void answer(Id wanted, Time now, protocol::Reaction& reaction);

  const protocol::DeviceState& device_;
  const bool by_datagrams_;
  std::uint8_t id_;

 private:
  protocol::Reaction on_datagram(std::size_t size, Time now);
  void on_frame(const Frame& frame, Time now, protocol::Reaction& reaction);
  void on_general_request(const Frame& frame, Time now, protocol::Reaction& reaction);

  DeviceInformation identity_;
  Framer framer_;
};

// The part that Surveyor, Omniscan, Ping1D and S500 share: they send pings over TCP or UDP while a host enables pings.

constexpr std::array<protocol::Port, 2> streaming_ports(std::uint16_t number, std::string_view carries) {
  // ping-python reads one message of each packet that it receives, so messages in one packet would fill its queue. The value is
  // our choice.
  constexpr std::chrono::milliseconds between_messages{3};
  return {{{.kind = protocol::Port::Kind::tcp_stream, .number = number, .carries = carries, .gap = between_messages},
           {.kind = protocol::Port::Kind::udp_dialogue, .number = number, .carries = carries}}};
}

/// The dialogue of a product that pings while a host enables pings. `Settings` have `id` and `parameters.enable`; change_to()
/// converts them to PingSettings.
template <class Settings, Settings (*settings_from)(const VendorSettings*)>
class StreamingConversation : public Conversation {
 public:
  /// Ignores the type in `identity`, because an option sets it.
  StreamingConversation(const protocol::DeviceState& device, const protocol::Port& port,
                        DeviceInformation identity = {.major = 1})
      : Conversation(device, port, typed(identity, device), settings_from(device.settings.get()).id) {}

  protocol::Reaction on_tick(Time, bool) override { return {}; }
  Time next_tick() const override { return Time::max(); }
  std::optional<std::chrono::milliseconds> longest_silence() const override {
    if (by_datagrams_ && settings().parameters.enable == 0) return std::chrono::seconds(10);  // our choice
    return Conversation::longest_silence();
  }

 protected:
  void on_new_id(protocol::Reaction& reaction) override {
    change(reaction, [](Settings&) {});
  }
  Settings settings() const { return settings_from(device_.settings.get()); }
  /// Returns the settings after the changes of this call, which the daemon has not made yet.
  Settings settings_after(const protocol::Reaction& reaction) const {
    return settings_from(protocol::settings_after(reaction, device_.settings.get()));
  }
  template <class Change>
  void change(protocol::Reaction& reaction, Change apply) {
    Settings s = settings_after(reaction);
    apply(s);
    s.id = id_;
    reaction.events.emplace_back(change_to(s));
  }

 private:
  static DeviceInformation typed(DeviceInformation identity, const protocol::DeviceState& device) {
    identity.type = static_cast<std::uint8_t>(number_option(device.options, option_name::device_type));
    return identity;
  }
};

class StreamingVendor : public protocol::Vendor {
 public:
  int default_max_clients() const override { return 1; }
  protocol::PingsBy pings_by() const override { return protocol::PingsBy::either; }
  bool is_request(const protocol::Port&, protocol::BytesView datagram) const override { return holds_frame(datagram); }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    protocol::Bytes all;
    for (const Bytes& one : frames_of(ping, device)) all.insert(all.end(), one.begin(), one.end());
    return std::make_shared<const protocol::Bytes>(std::move(all));
  }
  std::vector<protocol::Bytes> datagrams(const protocol::Port&, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    return frames_of(ping, device);
  }
  void reseal(protocol::BytesView before, protocol::Bytes& ping) const override { sonar::ping::reseal(before, ping); }

 protected:
  /// Returns the frames of a ping, in the order of sending.
  virtual std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) const = 0;
};

/// Options of Surveyor, Omniscan and S500.
inline std::span<const protocol::Option> streaming_options() {
  static const std::array<protocol::Option, 2> all{
      {type_option("0", "number of the product in its device information"), silence_option()}};
  return all;
}

}  // namespace sonar::ping
