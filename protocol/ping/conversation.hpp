// The conversation that every device of the family has with a host: frames, identity, numbers of devices. A product adds its own
// requests.
#pragma once

#include <string_view>

#include "protocol/options.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping {

using protocol::number_option;
using protocol::text_option;

/// Options that every product has.
namespace option_name {
inline constexpr std::string_view device_type = "device_type", silence_s = "host_silence_s";
}
protocol::Option silence_option();
protocol::Option type_option(std::string_view usual, std::string_view meaning);

class Conversation : public protocol::Dialogue {
 public:
  /// `device` outlives it. At a port of kind udp_dialogue a frame does not continue in the next datagram.
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
  /// A request of the product, its sum right. False: it has no such request.
  virtual bool on_request(const Frame& frame, Time now, protocol::Reaction& reaction) = 0;
  /// The message of that number as it is now, beyond those of every product; empty: there is none.
  virtual Bytes message_now(Id wanted, Time now) = 0;
  /// It is sent with every ping, and pings are enabled: the next one is the answer.
  virtual bool comes_with_pings(Id) const { return false; }
  /// It answers the request for that message by itself.
  virtual bool on_wanted(Id wanted, Time now, protocol::Reaction& reaction) {
    static_cast<void>(wanted), static_cast<void>(now), static_cast<void>(reaction);
    return false;
  }
  /// A host has set id_.
  virtual void on_new_id(protocol::Reaction&) {}

  /// A request whose payload is the message; false when that is too short, which is refused.
  template <class M>
  bool read(const Frame& frame, M& message, protocol::Reaction& reaction) const {
    wire::Reader reader(frame.payload);
    fields(reader, message);
    if (!reader.ok()) refuse(frame, reader.failure_text(), reaction);
    return reader.ok();
  }
  void refuse(const Frame& frame, const std::string& why, protocol::Reaction& reaction) const;
  void set_id(const Frame& frame, protocol::Reaction& reaction);
  /// Answers a request for that message.
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
