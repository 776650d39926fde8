#include <algorithm>
#include <cmath>
#include <cstdio>

#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

constexpr double tolerated_difference = 0.1;  // limit of the strictest public driver, for gain, sound speed and salinity

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}
std::string number(std::uint64_t value) { return std::to_string(value); }

/// Collects a sentence for each condition that a message violates.
class Check {
 public:
  void equal(const char* what, auto value, const char* with, auto expected) {
    if (static_cast<std::uint64_t>(value) != static_cast<std::uint64_t>(expected))
      add(std::string(what) + " is " + number(static_cast<std::uint64_t>(value)) + " but " + with + " is " +
          number(static_cast<std::uint64_t>(expected)));
  }
  void exact(const char* what, double value, double expected) {
    if (!(value == expected)) add("echoed " + std::string(what) + " is " + number(value) + ", requested " + number(expected));
  }
  void close(const char* what, double value, double expected) {
    if (!(std::abs(value - expected) <= tolerated_difference))
      add("echoed " + std::string(what) + " is " + number(value) + ", expected " + number(expected));
  }
  void holds(bool statement, std::string otherwise) {
    if (!statement) add(std::move(otherwise));
  }
  std::vector<std::string> violations() { return std::move(violations_); }

 private:
  void add(std::string sentence) { violations_.push_back(std::move(sentence)); }
  std::vector<std::string> violations_;
};

/// Checks sizes. VND, BAS and MRG drop a ping with trailing bytes; APL drops a ping whose image size contradicts the echoed flags
/// (docs/protocols/oculus.md, 5.1).
void check_sizes(Check& check, const DecodedPing& ping) {
  const PingResultV2& fixed = ping.head.fixed;
  const ImageSizes& sizes = fixed.sizes;
  const std::size_t fixed_size = fixed.header.version >= 2 ? ping_v2_size : ping_v1_size;
  const bool gains = (fixed.fire.flags & flag::row_gains) != 0;
  const std::size_t row = fixed.beam_count * ping.bytes_per_sample() + (gains ? 4 : 0);
  check.equal("payload_size + 16", std::uint64_t{fixed.header.payload_size} + header_size, "the message's length",
              ping.message.size());
  check.equal("message_size", sizes.message_size, "the message's length", ping.message.size());
  check.equal("image_offset + image_size", std::uint64_t{sizes.image_offset} + sizes.image_size, "message_size",
              sizes.message_size);
  check.equal("image_size", sizes.image_size, "rows x (beams x sample bytes + gain bytes)", fixed.row_count * row);
  check.holds(sizes.image_offset > ping_v1_size,
              "image_offset " + number(std::uint64_t{sizes.image_offset}) + " must exceed 122");
  check.holds(sizes.image_offset >= fixed_size + 2u * fixed.beam_count,
              "image_offset " + number(std::uint64_t{sizes.image_offset}) + " lies inside the bearing table");
  check.holds(ping.has_image, "the image does not lie inside the message");
}

/// Checks the image. ENS divides samples by the root of the row gain, so a gain of 0 is a violation.
void check_image(Check& check, const DecodedPing& ping) {
  const PingResultV2& fixed = ping.head.fixed;
  check.holds(fixed.row_count >= 1, "there is no row");
  check.holds(fixed.beam_count >= 1, "there is no beam");
  check.holds(fixed.data_size <= DataSize::bits32,
              "data_size " + number(static_cast<std::uint64_t>(fixed.data_size)) + " is unknown");
  const bool long_samples =
      (fixed.fire.flags & flag::samples_16_bit) != 0 || (fixed.extension.flags & flag::extended_32_bit) != 0;
  check.holds(long_samples == (fixed.data_size != DataSize::bits8), "data_size contradicts the echoed flags");
  check.holds(std::adjacent_find(ping.bearings_cdeg.begin(), ping.bearings_cdeg.end(), std::greater_equal<>()) ==
                  ping.bearings_cdeg.end(),
              "bearings do not ascend");
  check.holds(std::find(ping.row_gains.begin(), ping.row_gains.end(), 0u) == ping.row_gains.end(), "a row gain is 0");
}

}  // namespace

std::vector<std::string> identity_violations(const DecodedPing& ping) {
  Check check;
  const PingResultV2& fixed = ping.head.fixed;
  check.equal("oculus_id", fixed.header.oculus_id, "the magic", magic);
  check.equal("msg_id", static_cast<std::uint16_t>(fixed.header.type), "a ping result's",
              static_cast<std::uint16_t>(MessageType::ping_result));
  check.holds(fixed.header.version <= 2, "msg_version " + number(std::uint64_t{fixed.header.version}) + " does not exist");
  check.holds(fixed.header.source != 0, "src_device_id is 0");
  check_sizes(check, ping);
  check_image(check, ping);
  check.holds(std::isfinite(fixed.range_resolution_m) && fixed.range_resolution_m > 0,
              "range_resolution " + number(fixed.range_resolution_m) + " is not above 0");
  check.holds(std::isfinite(fixed.sound_speed_mps) && fixed.sound_speed_mps > 0,
              "speed_of_sound_used " + number(fixed.sound_speed_mps) + " is not above 0");
  check.holds(std::isfinite(fixed.frequency_hz) && fixed.frequency_hz > 0,
              "frequency " + number(fixed.frequency_hz) + " is not above 0");
  check.holds(std::isfinite(fixed.temperature_c) && std::isfinite(fixed.pressure_bar), "temperature or pressure is not finite");
  return check.violations();
}

/// Compares the fields of request and echo that ENS and BLU compare; these drivers repeat the request until both agree
/// (docs/protocols/oculus.md, 5.5).
std::vector<std::string> echo_violations(const FireRequest& sent, const DecodedPing& ping, std::string_view gain_echo) {
  Check check;
  const FireSettings& asked = sent.settings;
  const FireSettings& echo = ping.head.fixed.fire;
  check.equal("msg_version", ping.head.fixed.header.version, "the request's", std::min<std::uint16_t>(sent.version, 2));
  check.exact("mode", echo.mode, asked.mode);
  check.exact("gamma", echo.gamma, asked.gamma);
  check.exact("flags", echo.flags, asked.flags);
  check.exact("range", echo.range, asked.range);
  check.exact("network speed", echo.network_speed, asked.network_speed);
  check.close("gain", echo.gain_percent, echoed_gain_percent(asked, gain_echo));
  check.close("sound speed", echo.sound_speed_mps,
              asked.sound_speed_mps != 0 ? asked.sound_speed_mps : ping.head.fixed.sound_speed_mps);
  check.close("salinity", echo.salinity_ppt, asked.salinity_ppt);
  check.exact("ext_flags", ping.head.fixed.extension.flags, sent.extension.flags);
  return check.violations();
}

std::vector<std::string> status_violations(const StatusMessage& status, std::size_t datagram_size) {
  Check check;
  check.equal("datagram length", datagram_size, "a status message's", status_size);
  check.equal("payload_size + 16", std::uint64_t{status.header.payload_size} + header_size, "a status message's length",
              status_size);
  check.equal("msg_id", static_cast<std::uint16_t>(status.header.type), "a status message's",
              static_cast<std::uint16_t>(MessageType::status));
  check.equal("src_device_id", status.header.source, "device_id", status.device_id);
  check.holds(status.device_id != 0, "device_id is 0");
  check.equal("device_type", status.device_type, "an imaging sonar's", 1u);
  check.equal("part_number in the header", status.header.part_number, "that in the body", status.part_number);
  // APL aborts when these bits are 0 or 1.
  check.holds((status.status & 7u) == 2 || (status.status & 7u) == 3, "status bits 0-2 say that the main firmware does not run");
  check.holds(status.ip_address != std::array<std::uint8_t, 4>{}, "ip_addr is 0.0.0.0");
  return check.violations();
}

// Ping numbers increase across clients, so a gap may be a ping for another client. It is counted, but is not a violation.
std::vector<std::string> PingSequence::add(const DecodedPing& ping) {
  Check check;
  const std::uint32_t id = ping.head.fixed.ping_id;
  if (last_id_) {
    check.holds(id > *last_id_,
                "ping_id " + number(std::uint64_t{id}) + " does not rise above " + number(std::uint64_t{*last_id_}));
    if (id > *last_id_) skipped_ids_ += id - *last_id_ - 1;
  }
  if (source_) check.equal("src_device_id", ping.head.fixed.header.source, "that of the ping before", *source_);
  last_id_ = id;
  source_ = ping.head.fixed.header.source;
  return check.violations();
}

}  // namespace sonar::oculus
