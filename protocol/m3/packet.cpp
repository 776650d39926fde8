#include "protocol/m3/m3.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <complex>
#include <cstdio>

#include "core/base/geometry.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/m3/settings.hpp"

namespace sonar::m3 {
namespace {

constexpr double full_scale = 1024;  // amplitude of a sample at full scale; unknown: the unit
constexpr std::size_t longest_body = 1 << 25;

void put(float value, std::byte* at) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (unsigned b = 0; b < 4; ++b) at[b] = static_cast<std::byte>(bits >> (8 * b));
}

/// Appends the complex samples beam by beam. Their amplitudes are the samples of the ping, which include gain and faults; their
/// phases are those of the beam signals before detection. A ping with expected power has no phases: its samples have phase 0.
void append_samples(const Ping& ping, bool from_starboard, Bytes& out) {
  const auto beams = static_cast<std::size_t>(ping.request.settings.beam_count);
  const auto rows = static_cast<std::size_t>(ping.request.settings.range_bin_count);
  const bool has_phase = ping.beam_signal_upa.size() == rows * beams;
  const std::size_t begin = out.size();
  out.resize(begin + sample_size * rows * beams);
  constexpr std::size_t block = 32;  // square blocks, so that the rows read and the beams written stay in cache
  constexpr double per_code = full_scale / 4294967296.0;
  for (std::size_t j0 = 0; j0 < beams; j0 += block)
    for (std::size_t k0 = 0; k0 < rows; k0 += block)
      for (std::size_t j = j0; j < std::min(beams, j0 + block); ++j)
        for (std::size_t k = k0; k < std::min(rows, k0 + block); ++k) {
          const std::size_t from = k * beams + j, beam = from_starboard ? beams - 1 - j : j;
          const auto amplitude = static_cast<float>(per_code * sample_code(ping.samples, from, 4));
          std::complex<float> value{amplitude, 0};
          if (has_phase) {
            const std::complex<float> signal = ping.beam_signal_upa[from];
            const float power = std::norm(signal);
            if (power > 0) value = signal * (amplitude / std::sqrt(power));
          }
          std::byte* const to = out.data() + begin + sample_size * (beam * rows + k);
          put(value.real(), to);
          put(value.imag(), to + 4);
        }
}

template <std::size_t size>
void set_text(std::array<char, size>& to, std::string_view text) {
  std::copy_n(text.begin(), std::min(text.size(), size - 1), to.begin());
}

void set_attitude(DataBack& to, const PingRequest& request) {
  const auto pitch = [](const RollPitchYaw& a) { return static_cast<float>(-deg_from_rad(a.pitch_rad)); };  // positive: bow up
  const auto roll = [](const RollPitchYaw& a) { return static_cast<float>(deg_from_rad(a.roll_rad)); };     // positive: port up
  const Quatd &vehicle = request.vehicle_in_world.orientation, &head = request.sonar_in_world.orientation;
  const RollPitchYaw angles = rpy_from_quat(vehicle), own = rpy_from_quat(head);
  to.heading_deg = static_cast<float>(deg_from_rad(heading_rad(vehicle)));
  to.pitch_deg = pitch(angles);
  to.roll_deg = roll(angles);
  to.own_heading_deg = static_cast<float>(deg_from_rad(heading_rad(head)));
  to.own_pitch_deg = pitch(own);
  to.own_roll_deg = roll(own);
  to.depth_m = static_cast<float>(depth_from_z(request.sonar_in_world.position_m.z));
  to.temperature_c = static_cast<float>(request.water.temperature_c);
}

/// Makes the data header of a ping. Fields that are not set here keep the defaults of messages.hpp.
DataHeader header_of(const Ping& ping, const protocol::DeviceState& device) {
  using namespace std::chrono;
  const PingRequest& r = ping.request;
  const Settings settings = settings_from(r.vendor_settings.get());
  const double near_m = near_of(settings.far_m);
  const Window window = window_of(near_m, settings.far_m);
  const auto fired_ms = duration_cast<milliseconds>(r.fired_at.time_since_epoch()).count();
  DataHeader header;
  DataFront& front = header.front;
  front.sonar_info[0] = device.id;
  front.time_s = static_cast<std::uint32_t>(fired_ms / 1000);
  front.time_ms = static_cast<std::uint32_t>(fired_ms % 1000);
  front.sound_speed_mps = r.settings.device_sound_speed_mps;
  front.samples = static_cast<std::uint32_t>(r.settings.range_bin_count);
  front.near_m = static_cast<float>(near_m);
  front.far_m = static_cast<float>(settings.far_m);
  front.start_s = static_cast<float>(window.start_s + transmit_s);
  front.length_s = static_cast<float>(window.samples * window.interval_s);
  front.beams = static_cast<std::uint16_t>(r.settings.beam_count);
  for (std::size_t i = 0; i < std::min<std::size_t>(front.beams, most_beams); ++i)
    header.beam_deg[i] = static_cast<float>((static_cast<double>(i) - 0.5 * (beam_count - 1)) * beam_spacing_deg);

  DataBack& back = header.back;
  back.sample_interval_s = static_cast<float>(window.interval_s);
  back.mode_id = 118;  // PKT: "Imaging 3"
  back.frequency_hz = static_cast<std::uint32_t>(device.model->modes.front().centre_hz);
  back.pulse_us = static_cast<std::uint32_t>(window.pulse_us);
  back.ping_number = static_cast<std::uint32_t>(r.number);
  // In PKT the bandwidth is half the sampling rate, and the resolution is half the length of the pulse at about 1450 m/s.
  back.filter_hz = static_cast<float>(0.5 / window.interval_s);
  back.resolution_m = static_cast<float>(1e-6 * window.pulse_us * 1450 / 2);
  back.ping_rate_hz = r.settings.rate_hz;
  back.gain.c_db = settings.c_db;
  set_text(back.application, device.model->modes.front().name);
  char pulse[32];
  std::snprintf(pulse, sizeof pulse, "'Tone Burst %dus'", window.pulse_us);
  set_text(back.pulse_name, pulse);
  set_attitude(back, r);
  back.transmit_s = static_cast<float>(transmit_s);
  back.ping_near_m = front.near_m;
  back.ping_far_m = front.far_m;
  back.sound_speeds = {front.sound_speed_mps, front.sound_speed_mps, front.sound_speed_mps, 2.5f};
  return header;
}

/// The part of a packet that determines its length. The size in the head alone cannot detect a false start within samples, so the
/// numbers of beams and samples must agree with this size.
struct StreamFront {
  PacketHead head;
  DataFront data;
};
constexpr void fields(auto& visit, wire::Like<StreamFront> auto& m) {
  visit("head", m.head);
  visit("data", m.data);
}
constexpr std::size_t stream_front_size = wire::wire_size<StreamFront>();

std::optional<std::size_t> length_of(BytesView bytes, recording::Origin from, bool) {
  StreamFront front;
  wire::Reader reader(bytes);
  fields(reader, front);
  const PacketHead& head = front.head;
  const bool in_step = std::all_of(head.sync.begin(), head.sync.end(), [](std::uint16_t word) { return word == sync_word; });
  if (!reader.ok() || !in_step || from != recording::Origin::device || head.type != DataType::complex_floats) return std::nullopt;
  const std::size_t samples = std::size_t{front.data.beams} * front.data.samples, body = head.body_size;
  if (front.data.beams > most_beams || samples == 0 || body > longest_body || body != data_header_size + sample_size * samples)
    return std::nullopt;
  return head_size + body + foot_size;
}

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

/// Returns offset and size of a region in a packet of `size` bytes.
Place place_of(protocol::Region region, std::size_t size) {
  switch (region) {
    case protocol::Region::header:
      return {0, head_size};
    case protocol::Region::metadata:  // the data header up to the table of bearings
      return {head_size, data_front_size};
    case protocol::Region::bearings:
      return {head_size + data_front_size, sizeof(float) * most_beams};
    case protocol::Region::image:
      return {samples_at, size - samples_at - foot_size};
  }
  return {};
}

}  // namespace

const recording::Framing framing{{sync_word & 0xFF, sync_word >> 8}, stream_front_size, length_of};

Bytes encode_packet(const Ping& ping, const protocol::DeviceState& device) {
  const PingSettings& s = ping.request.settings;
  const std::size_t size = sample_size * static_cast<std::size_t>(s.beam_count) * static_cast<std::size_t>(s.range_bin_count);
  PacketHead head;
  head.body_size = static_cast<std::uint32_t>(data_header_size + size);
  Bytes out;
  out.reserve(head_size + head.body_size + foot_size);
  wire::append(out, head);
  wire::append(out, header_of(ping, device));
  append_samples(ping, protocol::text_option(device.options, option_name::positive_angles) != "starboard", out);
  PacketFoot foot;
  foot.body_size = head.body_size;
  wire::append(out, foot);
  return out;
}

double Packet::start_m() const {
  return (static_cast<double>(header.front.start_s) - static_cast<double>(header.back.transmit_s)) *
         static_cast<double>(header.front.sound_speed_mps) / 2;
}
double Packet::spacing_m() const {
  return static_cast<double>(header.back.sample_interval_s) * static_cast<double>(header.front.sound_speed_mps) / 2;
}

// The foot repeats the size of the body; if the sizes differ, the packet is cut or damaged.
std::optional<Packet> read_packet(BytesView whole) {
  if (!framing.begins_message(whole, recording::Origin::device)) return std::nullopt;
  const auto length = length_of(whole.first(stream_front_size), recording::Origin::device, true);
  if (length != whole.size()) return std::nullopt;
  PacketFront front;
  wire::Reader reader(whole);
  fields(reader, front);
  const BytesView samples = reader.block("samples", front.head.body_size - data_header_size);
  PacketFoot foot;
  fields(reader, foot);
  if (!reader.ok() || foot.body_size != front.head.body_size) return std::nullopt;
  return Packet{front.data, samples};
}

// Finds in a packet the fields and regions that faults change.
std::optional<protocol::Field> locate(protocol::FieldName name, BytesView packet) {
  return wire::locate<PacketFront>(name, packet);
}

std::optional<Place> locate(protocol::Region region, BytesView packet) {
  if (packet.empty()) return Place{};
  if (packet.size() < samples_at + foot_size) return std::nullopt;
  return place_of(region, packet.size());
}

}  // namespace sonar::m3
