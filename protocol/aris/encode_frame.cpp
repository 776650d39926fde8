#include "protocol/aris/encode_frame.hpp"

#include <algorithm>
#include <array>
#include <cassert>

#include "core/base/geometry.hpp"

namespace sonar::aris {
namespace {

/// Each ping of a frame makes 16 beams, one for each channel of the digitiser. If a frame has n pings, channel k of ping p is
/// beam n * sixteenth[k] + p. This order is a property of the hardware; the vendor's library has the same table.
constexpr std::array<std::size_t, channels> sixteenth{10, 2, 14, 6, 8, 0, 12, 4, 11, 3, 15, 7, 9, 1, 13, 5};
constexpr std::size_t first_part_samples = 620, part_samples = 1370;  // samples in a datagram of 1400 bytes
constexpr std::size_t largest_picture = std::size_t{most_samples} * 128;
/// The header has the absolute pressure. Clients of the vendor's SDK compute (pressure - 14.6959) x 0.702398 as the depth.
constexpr double surface_psi = 14.6959, psi_per_m = 1 / 0.702398;

std::uint64_t microseconds(std::chrono::nanoseconds t) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(std::chrono::floor<std::chrono::microseconds>(t).count(), 0));
}

/// Calls `copy(raw index, picture index)` for each sample.
void for_each_sample(std::size_t samples, int pings, auto copy) {
  const auto n = static_cast<std::size_t>(pings), beams = n * channels;
  std::size_t raw = 0;
  for (std::size_t ping = 0; ping < n; ++ping)
    for (std::size_t sample = 0; sample < samples; ++sample)
      for (std::size_t channel = 0; channel < channels; ++channel) copy(raw++, sample * beams + sixteenth[channel] * n + ping);
}

/// Copies the controller's acoustic settings, which judge() has limited. Only window and sound speed are from PingSettings,
/// because they are those at the time of the ping.
void set_settings(FrameHeader& h, const Settings& s, const PingSettings& used, const Product& product) {
  const Acoustics& a = s.acoustics;
  h.window_start_m = static_cast<float>(used.range_start_m);
  h.window_length_m = static_cast<float>(used.range_bin_count * used.range_bin_m);
  h.receiver_gain_db = static_cast<std::uint32_t>(a.gain_db + 0.5f);
  h.sample_rate_hz = 1e6f / static_cast<float>(a.sample_period_us);
  h.ping_mode = a.ping_mode;
  h.frequency = static_cast<std::uint32_t>(a.frequency);
  h.pulse_us = a.pulse_us;
  h.cycle_us = a.cycle_us;
  h.sample_period_us = a.sample_period_us;
  h.transmit = a.transmit;
  h.frame_rate_hz = a.frame_rate_hz;
  h.sound_speed_mps = used.device_sound_speed_mps;
  h.samples_per_beam = a.samples_per_beam;
  h.high_voltage = a.high_voltage;
  h.start_delay_us = a.start_delay_us;
  h.large_lens = s.telephoto && product.has_telephoto;
  h.salinity = s.salinity;
  h.applied_cookie = s.applied;
  h.constrained_cookie = s.constrained;
  h.invalid_cookie = s.invalid;
  h.interpacket_delay = s.delays_packets;
  h.interpacket_delay_us = s.packet_delay_us;
}

/// Sets the attitude of the sonar, not of the vehicle, because compass and accelerometer are in the sonar.
void set_attitude(FrameHeader& h, const Quatd& sonar_in_world) {
  const RollPitchYaw angles = rpy_from_quat(sonar_in_world);
  h.compass_heading_deg = static_cast<float>(deg_from_rad(heading_rad(sonar_in_world)));
  h.compass_pitch_deg = static_cast<float>(-deg_from_rad(angles.pitch_rad));  // a positive pitch_rad is bow down
  h.compass_roll_deg = static_cast<float>(deg_from_rad(angles.roll_rad));
  const Vec3d down = rotate(conjugate(sonar_in_world), Vec3d{0, 0, -1});
  h.acceleration_g = {static_cast<float>(down.x), static_cast<float>(down.y), static_cast<float>(down.z)};
}

/// Makes the header. All times of a frame are equal, because the emulated sonar has no delay between trigger, ping and frame.
FrameHeader header_of(const Ping& ping, const protocol::DeviceState& device, const Settings& settings, std::int32_t index) {
  const PingRequest& request = ping.request;
  FrameHeader h;
  h.frame_index = static_cast<std::uint32_t>(index - 1);
  h.frame_time_us = h.sonar_time_us = h.go_time_us = microseconds((request.fired_at + settings.clock_offset).time_since_epoch());
  h.uptime_s = static_cast<std::uint32_t>(std::max(seconds(request.fired_at - device.powered_up_at), 0.0));
  h.system = static_cast<std::uint32_t>(product_of(*device.model).system);
  h.serial = device.id;
  h.water_c = static_cast<float>(request.water.temperature_c);
  h.pressure_psi = static_cast<float>(surface_psi + psi_per_m * depth_from_z(request.sonar_in_world.position_m.z));
  const FocusNow focus = focus_at(settings, request.fired_at);
  h.focus = h.focus_position = focus.position;
  h.focus_motor_moving = focus.moves;
  set_settings(h, settings, request.settings, product_of(*device.model));
  set_attitude(h, request.sonar_in_world.orientation);
  return h;
}

/// Returns the samples with the beams of each row in reverse order, because beam 0 of a Ping is at port, beam 0 of an ARIS at
/// starboard.
Bytes mirrored(const Ping& ping) {
  const auto beams = static_cast<std::ptrdiff_t>(ping.request.settings.beam_count);
  Bytes out(ping.samples);
  for (auto row = out.begin(); row != out.end(); row += beams) std::reverse(row, row + beams);
  return out;
}

using protocol::Field;
using protocol::FieldName;

constexpr std::int64_t too_hot = 0x4000, stopped_by_heat = 0x8000;  // status bits of an Oculus, which faults use

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

Place place_of(BytesView inside, BytesView whole) {
  return {inside.empty() ? whole.size() : static_cast<std::size_t>(inside.data() - whole.data()), inside.size()};
}

/// Returns the first part of a frame; nullopt if the part has no frame header.
std::optional<FramePart> first_of(BytesView first_part) {
  FramePart part;
  return protobuf::read(first_part, part) && part.header ? std::optional(part) : std::nullopt;
}

}  // namespace

Bytes raw_from_picture(BytesView picture, std::size_t samples, int pings) {
  Bytes raw(picture.size());
  for_each_sample(samples, pings, [&](std::size_t to, std::size_t from) { raw[to] = picture[from]; });
  return raw;
}

Bytes picture_from_raw(BytesView raw, std::size_t samples, int pings) {
  Bytes picture(raw.size());
  for_each_sample(samples, pings, [&](std::size_t from, std::size_t to) { picture[to] = raw[from]; });
  return picture;
}

// In datagrams of 1400 bytes, the first part has room for the header and 620 samples, and each other part for 1370 samples. Each
// additional byte of `longest` makes room for one more sample.
std::vector<Bytes> parts_of(std::int32_t frame_index, BytesView header, BytesView samples, std::size_t longest) {
  const std::size_t more = longest - longest_datagram;
  std::vector<Bytes> parts;
  for (std::size_t at = 0; at < samples.size() || parts.empty();) {
    FramePart part{frame_index, static_cast<std::int32_t>(samples.size()), {}, {}, static_cast<std::int32_t>(at)};
    if (at == 0) part.header = header;
    part.data = samples.subspan(at, std::min((at == 0 ? first_part_samples : part_samples) + more, samples.size() - at));
    at += part.data.size();
    parts.push_back(protobuf::bytes_of(part));
    assert(parts.back().size() <= longest);
  }
  return parts;
}

// The daemon numbers pings across all connections; frame numbers begin at 1 in each connection (docs/protocols/aris.md,
// "Session").
std::vector<Bytes> encode_frame(const Ping& ping, const protocol::DeviceState& device, const Settings& settings) {
  const auto number = static_cast<std::uint32_t>(ping.request.number);
  const auto index = static_cast<std::int32_t>(number > settings.first_ping ? number - settings.first_ping : number);
  FrameHeader header = header_of(ping, device, settings, index);
  Bytes samples = mirrored(ping);
  header.reordered = text_option(device.options, option_name::reordered) == "true";
  if (!header.reordered)
    samples = raw_from_picture(samples, header.samples_per_beam, ping.request.settings.beam_count / channels);
  const auto size = [&](std::string_view name) { return static_cast<std::size_t>(number_option(device.options, name)); };
  const Bytes whole_header = wire::bytes_of(header);
  return parts_of(index, BytesView(whole_header).first(size(option_name::header_bytes)), samples,
                  size(option_name::datagram_bytes));
}

Bytes make_beacon(const protocol::DeviceState& device) {
  Availability a;
  a.serial = device.id;
  a.system = product_of(*device.model).system;
  a.busy = device.connected_client != protocol::Ipv4{};
  a.capabilities.enabled = {"KA"};  // keep-alives
  a.cpu_c = 30;
  a.hot_limit_c = 70;  // unknown: assumed
  a.hot_limit_s = 60;
  return protobuf::bytes_of(a);
}

std::optional<DecodedFrame> FrameAssembler::add(BytesView datagram) {
  FramePart part;
  if (!protobuf::read(datagram, part) || part.total_size <= 0 || part.data_offset < 0) return std::nullopt;
  const auto total = static_cast<std::size_t>(part.total_size), at = static_cast<std::size_t>(part.data_offset);
  if (total > largest_picture || at + part.data.size() > total) return std::nullopt;
  if (part.frame_index != index_ || done_ || total != total_) {
    if (part.frame_index == index_ && total == total_) return std::nullopt;  // the part is a repetition
    incomplete_ += done_ ? 0 : 1;
    index_ = part.frame_index;
    total_ = total;
    received_ = 0;
    done_ = false;
    header_.clear();
    samples_.assign(total, std::byte{});
    has_.assign(total, false);
  }
  if (part.header) header_.assign(part.header->begin(), part.header->end());
  for (std::size_t i = 0; i < part.data.size(); ++i) {
    samples_[at + i] = part.data[i];
    received_ += has_[at + i] ? 0 : 1;
    has_[at + i] = true;
  }
  return received_ == total_ && !header_.empty() ? whole() : std::nullopt;
}

// Older firmware sends shorter headers; the missing fields read as 0.
std::optional<DecodedFrame> FrameAssembler::whole() {
  done_ = true;
  DecodedFrame frame;
  frame.index = index_;
  header_.resize(std::max(header_.size(), header_size));
  wire::Reader reader(header_);
  fields(reader, frame.header);
  frame.samples = frame.header.samples_per_beam;
  if (frame.samples == 0 || total_ % frame.samples != 0) return std::nullopt;
  frame.beams = total_ / frame.samples;
  if (frame.beams == 0 || frame.beams % channels != 0) return std::nullopt;
  frame.picture = frame.header.reordered != 0
                      ? samples_
                      : picture_from_raw(samples_, frame.samples, static_cast<int>(frame.beams / channels));
  return frame;
}

// The functions below find and change fields of a frame's datagrams and of the beacon. Fields of the frame header have a fixed
// offset. Integers of the protobuf messages are varints, whose offset and size depend on other values; to change an integer, the
// message is decoded and encoded again.

// For an empty message, returns the position in the frame header, as Vendor::field() requires.
std::optional<Field> locate(FieldName name, BytesView first_part) {
  auto found = wire::locate<FrameHeader>(name);
  if (!found || first_part.empty()) return found;
  const auto part = first_of(first_part);
  if (!part || found->offset + found->size > part->header->size()) return std::nullopt;
  found->offset += place_of(*part->header, first_part).first;
  return found;
}

std::optional<Place> locate(protocol::Region region, BytesView first_part) {
  if (region == protocol::Region::bearings) return std::nullopt;  // frames have no table: the ping mode determines the bearings
  if (first_part.empty()) return Place{};
  const auto part = first_of(first_part);
  if (!part) return std::nullopt;
  const Place header = place_of(*part->header, first_part);
  if (region == protocol::Region::header) return Place{0, header.first};
  return region == protocol::Region::metadata ? header : place_of(part->data, first_part);
}

bool change_part(FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& bytes) {
  if (name != FieldName::ping_id && name != FieldName::image_size) return false;
  FramePart part;
  if (bytes.empty() || !protobuf::read(bytes, part)) return bytes.empty();
  Bytes header = part.header ? Bytes(part.header->begin(), part.header->end()) : Bytes{};
  if (part.header) part.header = header;
  if (name == FieldName::image_size) {
    part.total_size = static_cast<std::int32_t>(change(part.total_size));
  } else {
    // Two fields contain the number: frame_index of the part counts from 1, FrameIndex of the header from 0.
    part.frame_index = static_cast<std::int32_t>(change(part.frame_index - 1) + 1);
    const auto number = static_cast<std::uint32_t>(part.frame_index - 1);
    Bytes index;
    wire::Writer write(index);
    write("FrameIndex", number);
    if (header.size() >= index.size()) std::copy(index.begin(), index.end(), header.begin());
  }
  bytes = protobuf::bytes_of(part);
  return true;
}

bool change_beacon(FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& bytes) {
  const bool known = name == FieldName::device_id || name == FieldName::connected_address || name == FieldName::device_status;
  Availability a;
  if (!known || bytes.empty() || !protobuf::read(bytes, a)) return known && bytes.empty();
  if (name == FieldName::device_id) {
    a.serial = static_cast<std::uint32_t>(change(a.serial));
  } else if (name == FieldName::connected_address) {
    a.busy = change(a.busy) != 0;
  } else {
    // An ARIS has no status word. The bits that faults set in the status word of an Oculus are converted to fields with the same
    // meaning.
    const std::int64_t status = change(0);
    if (status & (too_hot | stopped_by_heat)) a.cpu_c = a.hot_limit_c + 2;
    if (status & stopped_by_heat) a.power_down_reason = 0;
  }
  bytes = protobuf::bytes_of(a);
  return true;
}

}  // namespace sonar::aris
