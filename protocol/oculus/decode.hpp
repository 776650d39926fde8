// The driver side: an incremental decoder for what a device sends, and the checks real drivers make.
// Used by clients/sonarctl and the tests; the fire messages it answers to are made by make_fire (fire.hpp).
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

/// One ping result. Always complete in its fixed part; tables and image only as far as the message really holds them.
struct DecodedPing {
  PingHead head;                            // version 0 and 1: extension, attitude and ping_start_time_s are 0
  std::vector<std::int16_t> bearings_cdeg;  // [beams], positive to starboard
  std::vector<std::uint32_t> row_gains;     // [rows] when the echoed flag bit 2 is set, else empty
  wire::Bytes message;                      // the whole message
  std::vector<std::string> violations;      // broken identities, a sentence each; empty for a sound ping
  bool has_image = false;                   // rows x beams samples lie inside the message

  std::size_t rows() const { return has_image ? head.fixed.row_count : 0; }
  std::size_t beams() const { return has_image ? head.fixed.beam_count : 0; }
  std::size_t bytes_per_sample() const;
  /// Row 0 nearest, beam 0 the first bearing. row < rows(), beam < beams().
  std::uint32_t sample(std::size_t row, std::size_t beam) const;
  /// The row's samples as they lie in the message.
  wire::BytesView row_samples(std::size_t row) const;
  /// Positive to port, our convention.
  double azimuth_rad(std::size_t beam) const;
  /// Range of a row's centre [m], in the device's metres.
  double row_range_m(std::size_t row) const;
};

struct LogText {
  MessageHeader header;
  std::string text;
};
struct OtherMessage {  // a type a driver has no use for, or a known type too short to read
  MessageHeader header;
  std::size_t size = 0;
  std::string why;
};
using Received = std::variant<DecodedPing, DummyMessage, UserConfigMessage, LogText, OtherMessage>;

/// Any message of at least 16 bytes, as framed.
Received decode_message(wire::BytesView message);
/// Nothing when the fixed part does not fit (then there is no ping to speak of).
std::optional<DecodedPing> decode_ping(wire::BytesView message);
/// A status datagram: at least 142 bytes with the right magic, or a sentence.
Result<StatusMessage> decode_status(wire::BytesView datagram);

/// The device's TCP stream, in whatever pieces it arrives. Lengths above reply_limit are junk and never sized for.
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

/// Identities of one ping result that some driver enforces; a sentence for each that is broken (identities.cpp).
std::vector<std::string> identity_violations(const DecodedPing& ping);
/// What drivers compare between their request and the echo; a sentence for each difference. `gain_echo` as the option.
std::vector<std::string> echo_violations(const FireRequest& sent, const DecodedPing& ping, std::string_view gain_echo = "auto");
/// The same for a status datagram: length, type, device id, addresses, status bits, temperature.
std::vector<std::string> status_violations(const StatusMessage& status, std::size_t datagram_size);

/// What must hold from ping to ping: one device id, ids that only rise. Skipped ids are counted, not complained about.
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
