// Description of a sonar: payload of HELLO_OK on the link, and first frame of every recording.
// docs/protocols/blueview-link.md describes it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/bvtsdk/core/bytes.hpp"
#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/socket.hpp"

namespace sonar::bvt {

struct HeadDescription {
  std::int32_t id = 0;
  std::string name;
  float min_range_m = 0, max_range_m = 0;
  float start_m = 0, stop_m = 0;
  std::int32_t centre_hz = 0;
  float fov_min_deg = 0, fov_max_deg = 0;
  std::uint16_t beams = 0;
  std::int32_t sound_speed_mps = 1500;
  float gain_db = 0;
  float tvg_db_per_m = 0;
  std::int32_t fluid = 0;  // 0 salt, 1 fresh, 2 other
};

/// Copies the settings that a host can change from one description to another; the other fields are fixed properties.
void copy_settings(HeadDescription& to, const HeadDescription& from);

struct SonarDescription {
  std::uint16_t version = 1;
  std::string model, name, serial, firmware;
  float temperature_c = 0;
  std::uint32_t capabilities = 0;  // bit 0: head numbers are strict; bit 1: its time may stop
  std::vector<HeadDescription> heads;

  bool strict_heads() const { return (capabilities & 1) != 0; }
  /// True for a simulator whose time may stop; silence is then no fault.
  bool may_be_silent() const { return (capabilities & 2) != 0; }
  /// Returns the head with this number, or null; a sonar with one head and non-strict numbers accepts 0 and 1.
  const HeadDescription* head(int number) const;
};

/// Decodes the payload of HELLO_OK; nullopt when it is invalid.
std::optional<SonarDescription> decode_description(BytesView payload);
Bytes encode_description(const SonarDescription& sonar);

// Finds sonars: sends "BVE?" datagrams and receives "BVE!" datagrams (docs/protocols/blueview-link.md, "Discovery"). It needs no
// thread, because answers stay in the socket until they are read.

class DiscoveryAgent {
 public:
  /// Clears the results and sends the question: by broadcast on every network and on loopback, and to every address in the
  /// environment variable BVE_DISCOVERY (separated by commas or spaces). Returns failed if there is no socket.
  Code start();
  /// Reads the answers that have arrived, and closes the socket.
  void stop();
  /// Returns the IPv4 addresses in the order of their answers. Sends the question again if the last one was over a second ago.
  const std::vector<std::string>& sonars();

 private:
  void ask();
  void receive_answers();

  Descriptor socket_;
  Deadline last_asked_{};
  std::vector<std::string> found_;
};

}  // namespace sonar::bvt
