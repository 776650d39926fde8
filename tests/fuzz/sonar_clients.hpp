// One emulated sonar and up to three clients in virtual time: the product's Sonar without sockets, clients that read at their own
// pace, and all conditions that must hold between them. conversation_fuzz.cpp runs it with a script of bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/emulator/sonar/sonar.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::fuzz {

/// Decodes a client's stream as a driver does. Fails unless messages are whole and pings in ascending order.
class StreamReader {
 public:
  virtual ~StreamReader() = default;
  virtual void read(protocol::BytesView bytes) = 0;
  /// Returns true if no part of a message is left.
  virtual bool at_a_message_end() const = 0;
};
std::unique_ptr<StreamReader> oculus_reader();
std::unique_ptr<StreamReader> blueview_reader();

class SonarClients {
 public:
  static constexpr std::size_t places = 3;

  /// `sonar` must have no vehicle; it is at rest at 3 m depth.
  explicit SonarClients(SonarConfig sonar);

  void connect(std::size_t place, Role role = Role::client);
  void receive(std::size_t place, protocol::BytesView bytes);  // the sonar gets these bytes from the client
  void tick(std::size_t place);                      // advances to the next tick of the client, which may be later than now
  void wait(std::chrono::nanoseconds time);          // events that become due in this time are handled, up to a bound
  void fire();                                       // advances to the next ping, which the engine finishes
  void write(std::size_t place, std::size_t bytes);  // the client reads this number of bytes
  void finish(std::size_t place);                    // ends the connection, as after a silence of the client
  void disconnect(std::size_t place);
  /// Stops the sonar; all clients read the rest and disconnect. No message may be missing.
  void end();

 private:
  struct Client {
    ConnectionId id = 0;
    bool served = false, finishing = false;
    std::unique_ptr<StreamReader> reader;
    Outbox::Message writing = {};  // `part`: index of the part that is being written; `done`: its written bytes
    std::size_t part = 0, done = 0;
  };
  void perform(Actions actions);
  std::optional<std::size_t> place_of(ConnectionId id) const;
  void tick_all_due();
  bool write_piece(Client& client, std::size_t& bytes);
  void check() const;

  std::unique_ptr<protocol::Vendor> vendor_;
  Config config_;
  World world_;
  Time now_;
  Sonar sonar_;
  std::optional<PingRequest> computing_;
  ConnectionId last_id_ = 0;
  std::array<std::optional<Client>, places> clients_;
};

}  // namespace sonar::fuzz
