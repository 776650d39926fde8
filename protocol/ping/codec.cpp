// The messages and files of the Ping Protocol, for recordings.
#include <algorithm>
#include <array>
#include <initializer_list>

#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping1d.hpp"
#include "protocol/ping/ping360_settings.hpp"
#include "protocol/ping/ping_log.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/s500.hpp"

namespace sonar::ping {
namespace {

using recording::RecordedMessage;

/// True if a device of the family sends or accepts this message.
bool is_known(Id id) {
  switch (id) {
    case Id::ack:
    case Id::nack:
    case Id::ascii_text:
    case Id::device_information:
    case Id::protocol_version:
    case Id::general_request:
    case Id::json_wrapper:
    case Id::utc_request:
    case Id::utc_response:
    case Id::set_net_info:
    case Id::set_device_id:
    case Id::set_sound_speed:
    case Id::water_stats:
    case Id::attitude_report:
    case Id::set_sound_speed_before:
    case Id::ping1d_set_device_id:
    case Id::ping1d_set_range:
    case Id::ping1d_set_mode_auto:
    case Id::ping1d_set_interval:
    case Id::ping1d_set_gain:
    case Id::ping1d_set_enable:
    case Id::s500_set_ping_params:
    case Id::ping1d_goto_bootloader:
    case Id::ping1d_firmware_version:
    case Id::ping1d_device_id:
    case Id::ping1d_voltage_5:
    case Id::ping1d_sound_speed:
    case Id::ping1d_range:
    case Id::ping1d_mode_auto:
    case Id::ping1d_interval:
    case Id::ping1d_gain:
    case Id::ping1d_transmit_duration:
    case Id::ping1d_general_info:
    case Id::ping1d_distance_simple:
    case Id::ping1d_distance:
    case Id::ping1d_processor_temperature:
    case Id::ping1d_pcb_temperature:
    case Id::ping1d_enable:
    case Id::s500_distance2:
    case Id::ping1d_profile:
    case Id::s500_profile6:
    case Id::ping1d_continuous_start:
    case Id::ping1d_continuous_stop:
    case Id::ping360_set_device_id:
    case Id::os_ping_params:
    case Id::os_mono_profile:
    case Id::device_data:
    case Id::auto_device_data:
    case Id::reset:
    case Id::transducer:
    case Id::auto_transmit:
    case Id::motor_off:
    case Id::yz_point_data:
    case Id::atof_point_data:
    case Id::set_ping_parameters:
      return true;
  }
  return false;
}

/// Returns the length of the frame with this header. `BR` has only two bytes, and samples may contain it, so `strict` also
/// requires a known message.
std::optional<std::size_t> length_of(BytesView bytes, recording::Origin, bool strict) {
  Header header;
  wire::Reader reader(bytes);
  fields(reader, header);
  if (strict && !is_known(header.id)) return std::nullopt;
  return reader.ok() ? std::optional(header_size + header.length + sum_size) : std::nullopt;
}

/// True if the message has a frame with one of these ids and a correct sum. The ids of the pings identify the product.
bool holds(const RecordedMessage& message, std::initializer_list<Id> pings) {
  Framer framer(longest_payload, true);
  framer.append(message.bytes);
  while (const auto frame = framer.next())
    if (frame->sum_is_right && std::find(pings.begin(), pings.end(), frame->header.id) != pings.end()) return true;
  return false;
}
std::optional<recording::Sender> one_of(const protocol::Vendor& vendor) { return recording::Sender{vendor.models().front()}; }

constexpr recording::Framing framing{{'B', 'R'}, header_size, length_of};

/// Returns the id of the message; Id{} if it is not a whole frame, or if its sum is wrong.
Id id_in(BytesView message) {
  const auto frame = whole_frame(message);
  return frame ? frame->header.id : Id{};
}
std::optional<recording::PingPart> part_if(bool is_part) { return is_part ? std::optional(recording::PingPart{}) : std::nullopt; }
/// True if the recorded `message` has more content than `poorer`, and `answer` converts it to `poorer`.
template <class ResultsOf, class Answer>
bool holds_result(BytesView message, BytesView poorer, ResultsOf results_of, Answer answer) {
  const Results result = results_of(id_in(poorer));
  if (result >= results_of(id_in(message))) return false;
  const std::vector<Bytes> made = answer(message, result);
  const auto frame = made.size() == 1 ? whole_frame(made.front()) : std::nullopt, recorded = whole_frame(poorer);
  return frame && recorded && frame->payload == recorded->payload;
}
/// Returns a part for each message that a Surveyor sends while pings are enabled. A ping may have several messages.
std::optional<recording::PingPart> surveyor_part(BytesView message) {
  const Id id = id_in(message);
  return part_if(id == Id::atof_point_data || id == Id::yz_point_data || id == Id::attitude_report || id == Id::water_stats);
}
/// Returns a part for the profile of an Omniscan. A log may also have messages of a Surveyor, which another replay serves.
std::optional<recording::PingPart> omniscan_part(BytesView message) { return part_if(id_in(message) == Id::os_mono_profile); }

constexpr std::array<recording::FileKind, 1> kinds{{{
    .ending = ".svlog",
    .name = "ping protocol log",
    .holds = "frames of a Surveyor, an Omniscan or an S500",
    .begins =
        [](BytesView front) {
          return recording::begins_with(front, {'B', 'R'});
        },
    .read = [](std::unique_ptr<recording::Source> source) -> Result<std::unique_ptr<recording::RecordingReader>> {
      return recording::read_ping_log(std::move(source));
    },
    .write = recording::write_ping_log,
}}};

}  // namespace

recording::Codec ping360::codec() {
  return {.sender =
              [](const RecordedMessage& message) {
                return holds(message, {Id::device_data, Id::auto_device_data}) ? one_of(vendor()) : std::nullopt;
              },
          .ping_part = [](BytesView message) -> std::optional<recording::PingPart> {
            const auto line = line_in(message);
            if (!line) return std::nullopt;
            // The angle of the line is computed for the usual mount, because drivers assume it.
            static const auto options = protocol::check_options(vendor(), {});
            return recording::PingPart{.head_rad = head_rad(line->ping.angle, *options)};
          },
          // The request selects one of the two messages of a line; the settings are those of the recording.
          .answer =
              [](BytesView message, const VendorSettings* request) {
                Settings s = settings_from(request);
                const auto line = line_in(message);
                s.ping = line->ping;
                return std::vector<Bytes>{encode(s, line->samples)};
              }};
}
recording::Codec surveyor::codec() {
  return {.framing = &framing,
          .files = kinds,
          .sender =
              [](const RecordedMessage& message) {
                return holds(message, {Id::atof_point_data, Id::yz_point_data}) ? one_of(vendor()) : std::nullopt;
              },
          .ping_part = surveyor_part};
}
recording::Codec omniscan::codec() {
  return {
      .framing = &framing,
      .files = kinds,
      .sender =
          [](const RecordedMessage& message) { return holds(message, {Id::os_mono_profile}) ? one_of(vendor()) : std::nullopt; },
      .ping_part = omniscan_part};
}

recording::Codec ping1d::codec() {
  return {
      .framing = &framing,
      .sender =
          [](const RecordedMessage& message) {
            return holds(message, {Id::ping1d_distance_simple, Id::ping1d_distance, Id::ping1d_profile}) ? one_of(vendor())
                                                                                                         : std::nullopt;
          },
      .ping_part = [](BytesView message) { return part_if(results_of(id_in(message)) != no_result); },
      .answer = [](BytesView message, const VendorSettings* request) { return answer(message, settings_from(request).results); },
      .is_richer = [](BytesView message, BytesView than) { return holds_result(message, than, results_of, answer); }};
}

recording::Codec s500::codec() {
  return {
      .framing = &framing,
      .files = kinds,
      .sender =
          [](const RecordedMessage& message) {
            return holds(message, {Id::s500_distance2, Id::s500_profile6}) ? one_of(vendor()) : std::nullopt;
          },
      .ping_part = [](BytesView message) { return part_if(results_of(id_in(message)) != no_result); },
      .answer = [](BytesView message, const VendorSettings* request) { return answer(message, settings_from(request).results); },
      .is_richer = [](BytesView message, BytesView than) { return holds_result(message, than, results_of, answer); }};
}

}  // namespace sonar::ping
