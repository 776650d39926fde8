// One device and up to three clients in virtual time, without sockets: what daemon/sonars/session.cpp does with a Dialogue and an
// Outbox, and everything that must hold between them. conversation_fuzz.cpp drives it by a script of bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/sonars/outbox.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/vendor.hpp"

namespace sonar::fuzz {

/// What a client receives, taken apart by the driver's side of its vendor: whole messages only, pings in rising order.
class StreamReader {
 public:
  virtual ~StreamReader() = default;
  virtual void read(protocol::BytesView bytes) = 0;
  /// Nothing of a message is left over.
  virtual bool at_a_message_end() const = 0;
};
std::unique_ptr<StreamReader> oculus_reader();
std::unique_ptr<StreamReader> blueview_reader();

struct Conversation {
  static constexpr std::size_t places = 3;

  Conversation(const protocol::Profile& profile, const protocol::OptionValues& options, OutboxRules rules);

  void connect(std::size_t place);
  void receive(std::size_t place, protocol::BytesView bytes);  // from the client
  void tick(std::size_t place);                                // at its next tick, which may be later than now
  void wait(std::chrono::nanoseconds time);                    // whatever falls due on the way is done, up to a bound
  void fire();                                                 // a ping with the settings that hold, to everybody
  void write(std::size_t place, std::size_t bytes);            // the client takes so many
  void finish(std::size_t place);                              // as when the daemon ends
  void disconnect(std::size_t place);
  /// Everybody takes what is left and goes; nothing may be missing.
  void end();

  protocol::DeviceState device;

 private:
  struct Client {
    std::unique_ptr<protocol::Dialogue> dialogue;
    Outbox outbox;
    std::unique_ptr<StreamReader> reader;
    Outbox::Message writing = {};  // and how far it got: bytes of its copy number `part`
    std::size_t part = 0, done = 0;
    std::uint64_t pings_offered = 0;
    bool finishing = false;
  };
  void handle(std::size_t place, protocol::Reaction reaction);
  void on_event(const protocol::Event& event);
  void tick_all_due();
  bool write_piece(Client& client, std::size_t& bytes);
  void check(const Client& client) const;
  std::shared_ptr<const protocol::Bytes> framed() const;

  const protocol::Vendor& vendor_;
  OutboxRules rules_;
  Time now_;
  PingSettings settings_;
  std::uint32_t pings_ = 0;
  std::array<std::optional<Client>, places> clients_;
};

}  // namespace sonar::fuzz
