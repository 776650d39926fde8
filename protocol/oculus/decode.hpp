// The driver's side: an incremental decoder for the messages of a device, and the checks that real drivers make. The host of the
// make (host.cpp), its codec and tests use them; make_fire (fire.hpp) makes the fire messages.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.hpp"
#include "protocol/oculus/encode_ping.hpp"
#include "protocol/oculus/fire.hpp"
#include "protocol/oculus/framer.hpp"

namespace sonar::oculus {

/// A ping result. The fixed part is complete; tables and image are present as far as the message contains them.
struct DecodedPing {
  PingHead head;                            // version 0 and 1: extension, attitude and ping_start_time_s are 0
  std::vector<std::int16_t> bearings_cdeg;  // [beams], positive to starboard
  std::vector<std::uint32_t> row_gains;     // [rows] when the echoed flag bit 2 is set, else empty
  wire::Bytes message;                      // the whole message
  std::vector<std::string> violations;      // broken identities; empty for a valid ping
  bool has_image = false;                   // rows x beams samples lie inside the message

  std::size_t rows() const { return has_image ? head.fixed.row_count : 0; }
  std::size_t beams() const { return has_image ? head.fixed.beam_count : 0; }
  std::size_t bytes_per_sample() const;
  /// Row 0 nearest, beam 0 the first bearing. row < rows(), beam < beams().
  std::uint32_t sample(std::size_t row, std::size_t beam) const;
  /// The bytes of the row's samples in the message.
  wire::BytesView row_samples(std::size_t row) const;
  /// Positive to port, sonard's convention.
  double azimuth_rad(std::size_t beam) const;
  /// Range of a row's centre [m], as the device computes it.
  double row_range_m(std::size_t row) const;
};

struct LogText {
  MessageHeader header;
  std::string text;
};
struct OtherMessage {  // a type that drivers ignore, or a known type too short to read
  MessageHeader header;
  std::size_t size = 0;
  std::string why;
};
using Received = std::variant<DecodedPing, DummyMessage, UserConfigMessage, LogText, OtherMessage>;

/// Decodes a framed message of at least 16 bytes.
Received decode_message(wire::BytesView message);
/// nullopt if the message is shorter than the fixed part.
std::optional<DecodedPing> decode_ping(wire::BytesView message);
/// Decodes a status datagram. Errors: bad_data for fewer than 142 bytes or a wrong magic.
Result<StatusMessage> decode_status(wire::BytesView datagram);

/// Decodes the TCP stream of a device, in chunks of any size. Lengths above reply_limit are junk; nothing is allocated for
/// them.
class Decoder {
 public:
  void append(wire::BytesView received) { framer_.append(received); }
  /// Drain until empty before the next append.
  std::optional<Received> next();
  std::uint64_t skipped_bytes() const { return framer_.skipped_bytes(); }
  std::size_t buffered_bytes() const { return framer_.buffered_bytes(); }

 private:
  Framer framer_{Sender::device};
};

/// The identities between fields that drivers check and this ping result violates (identities.cpp).
std::vector<std::string> identity_violations(const DecodedPing& ping);
/// The differences between a request and its echo that drivers check. `gain_echo` as the option.
std::vector<std::string> echo_violations(const FireRequest& sent, const DecodedPing& ping, std::string_view gain_echo = "auto");
/// The violations of a status datagram: length, type, device id, addresses, status bits.
std::vector<std::string> status_violations(const StatusMessage& status, std::size_t datagram_size);

/// Checks between pings: one device id, rising ping ids. Skipped ids are counted, not reported as violations.
class PingSequence {
 public:
  std::vector<std::string> add(const DecodedPing& ping);
  std::uint64_t skipped_ids() const { return skipped_ids_; }

 private:
  std::optional<std::uint32_t> last_id_;
  std::optional<std::uint16_t> source_;
  std::uint64_t skipped_ids_ = 0;
};

}  // namespace sonar::oculus
