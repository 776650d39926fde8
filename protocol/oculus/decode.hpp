// The driver's side: an incremental decoder for the messages of a device, and the checks that real drivers make, for the host of
// the make (host.cpp), the codec and tests. make_fire (fire.hpp) makes the fire messages.
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
  /// Returns a sample; row 0 is nearest, beam 0 has the first bearing. row < rows(), beam < beams().
  std::uint32_t sample(std::size_t row, std::size_t beam) const;
  /// Returns the bytes of the row's samples in the message.
  wire::BytesView row_samples(std::size_t row) const;
  /// Returns the azimuth of a beam, positive to port (the convention of sonard).
  double azimuth_rad(std::size_t beam) const;
  /// Returns the range of a row's centre [m], as the device computes it.
  double row_range_m(std::size_t row) const;
};

struct LogText {
  MessageHeader header;
  std::string text;
};
struct OtherMessage {  // a message of a type that drivers ignore, or one too short to read
  MessageHeader header;
  std::size_t size = 0;
  std::string why;
};
using Received = std::variant<DecodedPing, DummyMessage, UserConfigMessage, LogText, OtherMessage>;

/// Decodes a framed message of at least 16 bytes.
Received decode_message(wire::BytesView message);
/// Decodes a ping; returns nullopt if the message is shorter than the fixed part.
std::optional<DecodedPing> decode_ping(wire::BytesView message);
/// Decodes a status datagram. Errors: bad_data for fewer than 142 bytes or a wrong magic.
Result<StatusMessage> decode_status(wire::BytesView datagram);

/// Decodes the TCP stream of a device, in chunks of any size. Bytes that state a length above reply_limit are junk, for which
/// nothing is allocated.
class Decoder {
 public:
  void append(wire::BytesView received) { framer_.append(received); }
  /// Call it until it returns nullopt, before the next append.
  std::optional<Received> next();
  std::uint64_t skipped_bytes() const { return framer_.skipped_bytes(); }
  std::size_t buffered_bytes() const { return framer_.buffered_bytes(); }

 private:
  Framer framer_{Sender::device};
};

/// Returns the identities between fields that drivers check, and that this ping result violates (identities.cpp).
std::vector<std::string> identity_violations(const DecodedPing& ping);
/// Returns the differences between a request and its echo that drivers check. `gain_echo`: value of the option.
std::vector<std::string> echo_violations(const FireRequest& sent, const DecodedPing& ping, std::string_view gain_echo = "auto");
/// Returns the violations of a status datagram: length, type, device id, addresses, status bits.
std::vector<std::string> status_violations(const StatusMessage& status, std::size_t datagram_size);

/// Checks that all pings have one device id, and that ping ids increase. Skipped ids are counted, not reported as violations.
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
