// The dialogue that all devices of the family share: frames, identity, device ids. A product adds its own requests.
#pragma once

#include <string_view>

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

}  // namespace sonar::ping
