#include "protocol/norbit/norbit.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/sonar/detections.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/norbit/settings.hpp"
#include "protocol/recorded/byte_source.hpp"

namespace sonar::norbit {
namespace {

constexpr double above_db = 15;           // threshold of the bottom above a beam's median; unknown: assumed
constexpr std::uint8_t good_quality = 8;  // DFD: quality of a signal 12 dB above the noise
constexpr std::size_t longest_packet = 24 + 168 + (1u << 20) + 4 * 512;
constexpr double most_pixel = 32767;

/// Makes a whole packet: the header, `front`, and `rest`.
Bytes sealed(Type type, const auto& front, const Bytes& rest) {
  Bytes body = wire::bytes_of(front);
  body.insert(body.end(), rest.begin(), rest.end());
  Header header;
  header.type = type;
  header.size = static_cast<std::uint32_t>(header_size + body.size());
  header.crc = recording::crc32(body);
  Bytes packet = wire::bytes_of(header);
  packet.insert(packet.end(), body.begin(), body.end());
  return packet;
}

std::optional<std::size_t> length_of(BytesView bytes, recording::Origin from, bool strict) {
  Header header;
  wire::Reader reader(bytes);
  fields(reader, header);
  if (!reader.ok() || from != recording::Origin::device || header.start != preamble || header.size <= header_size ||
      header.size > longest_packet)
    return std::nullopt;
  if (strict && (header.version != version || (header.type != Type::bathymetry && header.type != Type::column)))
    return std::nullopt;
  return header.size;
}

/// Returns the bytes after the header of a whole packet of that type; nullopt for other bytes.
std::optional<BytesView> body_of(BytesView packet, Type type) {
  Header header;
  wire::Reader reader(packet);
  fields(reader, header);
  if (!reader.ok() || length_of(packet, recording::Origin::device, true) != packet.size() || header.type != type)
    return std::nullopt;
  const BytesView body = packet.subspan(header_size);
  return recording::crc32(body) == header.crc ? std::optional(body) : std::nullopt;
}

/// Returns the power of each code re full scale, with the analog gain at range 0.
const std::vector<float>& powers_of_codes() {
  static const std::vector<float> all = [] {
    const double span = static_cast<double>(sample_format.ceiling_db) - static_cast<double>(sample_format.floor_db);
    std::vector<float> powers;
    for (std::uint32_t code = 0; code <= sample_format.max_code; ++code)
      powers.push_back(static_cast<float>(
          std::pow(10, (static_cast<double>(sample_format.floor_db) + span * code / sample_format.max_code) / 10)));
    return powers;
  }();
  return all;
}
double power_at(const Ping& ping, int row, int beam) {
  const std::size_t at = static_cast<std::size_t>(row * ping.request.settings.beam_count + beam);
  return static_cast<double>(powers_of_codes()[sample_code(ping.samples, at, 2)]);
}

/// Fills in the fields that both packets have.
template <class Front>
Front front_of(const Ping& ping, const protocol::DeviceState& device) {
  Front front;
  const PingSettings& s = ping.request.settings;
  front.sound_mps = s.device_sound_speed_mps;
  front.ping = static_cast<std::uint32_t>(ping.request.number);
  front.time_s = front.network_time_s = seconds(ping.request.fired_at.time_since_epoch());
  front.rate_hz = s.rate_hz;
  front.sonar_mode = static_cast<std::uint8_t>(mode_of(*device.model));
  front.pulse_s = 1e-6f * pulse_us;
  front.swath_rad = static_cast<float>(rad_from_deg(swath_deg));
  return front;
}

Grid grid_in(const Ping& ping) {
  return grid_of(settings_from(ping.request.vendor_settings.get()),
                 static_cast<double>(ping.request.settings.device_sound_speed_mps));
}

/// Returns the pixels of the water column in the order of the packet.
Bytes column_pixels(const Ping& ping) {
  const Settings settings = settings_from(ping.request.vendor_settings.get());
  const Grid grid = grid_in(ping);
  const int coarse = grid.step * grid.thin, beam_step = ping.request.settings.beam_count / settings.beams;
  const double coarse_m = coarse * grid.sample_m;
  Bytes pixels;
  pixels.reserve(pixel_size * static_cast<std::size_t>(grid.column_rows() * settings.beams));
  wire::Writer write(pixels);
  for (int m = 0; m < grid.column_rows(); ++m) {
    const double range_m = (grid.first / coarse + m) * coarse_m;
    const double more_db = std::min(2 * range_m * gain_slope_db_per_m, most_gain_db - settings.gain_db);
    const double scale = most_pixel * std::pow(10, more_db / 20);
    const int begin = std::max(0, m * grid.thin - grid.thin / 2), end = std::min(grid.rows, m * grid.thin + grid.thin / 2 + 1);
    for (int n = 0; n < settings.beams; ++n) {
      double sum = 0;
      for (int row = begin; row < end; ++row)
        for (int beam = n * beam_step; beam < (n + 1) * beam_step; ++beam) sum += power_at(ping, row, beam);
      const double level = scale * std::sqrt(sum / ((end - begin) * beam_step));
      const auto pixel = static_cast<std::int16_t>(std::lround(std::min(level, most_pixel)));
      write("pixel", pixel);
    }
  }
  return pixels;
}

/// The parts of the packets that take long to make. They are made with the ping, not on the I/O thread.
struct Findings {
  std::vector<Detection> bottom;
  Bytes pixels;
};
std::shared_ptr<const Findings> find(const Ping& ping) {
  return std::make_shared<const Findings>(
      Findings{detect_points(ping, bottom_beams, above_db, rad_from_deg(beam_width_deg)), column_pixels(ping)});
}

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

/// Reads a header; returns nullopt if the bytes do not begin with one.
std::optional<Header> header_of(BytesView bytes) {
  Header header;
  wire::Reader reader(bytes);
  fields(reader, header);
  return reader.ok() ? std::optional(header) : std::nullopt;
}

template <class Front>
std::optional<protocol::Field> in_packet(protocol::FieldName name, BytesView packet) {
  const auto found = wire::locate<Header>(name, packet);
  return found ? found : wire::locate<Front>(name, packet, header_size);
}

}  // namespace

std::shared_ptr<const PingFindings> findings_of(const Settings&, const Ping& ping) { return protocol::found(find(ping)); }

const recording::Framing framing{{preamble & 0xFF, preamble >> 8 & 0xFF}, header_size, length_of};

Bytes encode_bathymetry(const Ping& ping, const protocol::DeviceState& device) {
  const Grid grid = grid_in(ping);
  const PingSettings& s = ping.request.settings;
  auto front = front_of<BathymetryFront>(ping, device);
  front.sample_hz = static_cast<float>(sample_hz);
  front.beams = bottom_beams;
  front.frequency_hz = static_cast<float>(1e3 * frequency_khz);
  front.bandwidth_hz = static_cast<float>(1e3 * bandwidth_khz);

  const auto gate = [](int sample) { return static_cast<std::uint16_t>(std::clamp(sample, 0, 65535)); };
  std::vector<Beam> beams(bottom_beams);
  const double port_rad = rad_from_deg(swath_deg / 2), part_rad = rad_from_deg(swath_deg) / bottom_beams;
  for (std::size_t i = 0; i < beams.size(); ++i) {
    beams[i].angle_rad = static_cast<float>((static_cast<double>(i) + 0.5) * part_rad - port_rad);
    beams[i].upper_gate = gate(grid.first);
    beams[i].lower_gate = gate(grid.first + grid.rows * grid.step);
  }
  const double gain = std::pow(10, static_cast<double>(s.gain_db) / 20);
  const auto& azimuths = ping.beam_azimuth_rad;
  const auto findings = protocol::found_in(ping, find);
  for (const Detection& found : findings->bottom) {
    const auto part = static_cast<int>((port_rad - found.azimuth_rad) / part_rad);
    Beam& beam = beams[static_cast<std::size_t>(std::clamp(part, 0, bottom_beams - 1))];
    beam.sample = static_cast<std::uint32_t>(std::lround(found.range_m / grid.sample_m));
    beam.angle_rad = static_cast<float>(-found.azimuth_rad);
    const auto nearest = std::min_element(azimuths.begin(), azimuths.end(), [&](float a, float b) {
      return std::abs(static_cast<double>(a) - found.azimuth_rad) < std::abs(static_cast<double>(b) - found.azimuth_rad);
    });
    const auto row = static_cast<int>(std::lround((found.range_m - s.range_start_m) / s.range_bin_m));
    beam.intensity = static_cast<float>(
        std::sqrt(power_at(ping, std::clamp(row, 0, s.range_bin_count - 1), static_cast<int>(nearest - azimuths.begin()))) /
        gain);
    beam.quality_flag = quality::signal_to_noise | quality::no_flyer;
    beam.quality_value = good_quality;
  }
  Bytes rest;
  rest.reserve(beams.size() * beam_size);
  for (const Beam& beam : beams) wire::append(rest, beam);
  return sealed(Type::bathymetry, front, rest);
}

Bytes encode_column(const Ping& ping, const protocol::DeviceState& device) {
  const Settings settings = settings_from(ping.request.vendor_settings.get());
  const Grid grid = grid_in(ping);
  const PingSettings& s = ping.request.settings;
  const int coarse = grid.step * grid.thin, beam_step = s.beam_count / settings.beams;
  const double coarse_m = coarse * grid.sample_m;
  auto front = front_of<ColumnFront>(ping, device);
  front.sample_hz = static_cast<float>(sample_hz / coarse);
  front.beams = static_cast<std::uint32_t>(settings.beams);
  front.samples = static_cast<std::uint32_t>(grid.column_rows());
  front.first_sample = grid.first / coarse;
  front.frequency_khz = static_cast<float>(frequency_khz);
  front.bandwidth_khz = static_cast<float>(bandwidth_khz);
  front.amplitude = amplitude;
  front.formed_beams = static_cast<std::uint32_t>(s.beam_count);
  front.beam_mode = s.beam_count > bottom_beams ? 1 : 2;
  front.gain_begin_db = static_cast<float>(settings.gain_db);
  front.gain_end_db = static_cast<float>(most_gain_db);
  front.gain_end = static_cast<std::int32_t>(std::lround((most_gain_db - settings.gain_db) / gain_slope_db_per_m / 2 / coarse_m));

  Bytes rest = protocol::found_in(ping, find)->pixels;
  wire::Writer write(rest);
  for (int n = 0; n < settings.beams; ++n) {
    const auto first = ping.beam_azimuth_rad.begin() + n * beam_step;
    const float angle_rad = -(first[0] + first[beam_step - 1]) / 2;
    write("direction", angle_rad);
  }
  return sealed(Type::column, front, rest);
}

double Bathymetry::range_m(const Beam& beam) const {
  return beam.sample * static_cast<double>(front.sound_mps) / 2 / static_cast<double>(front.sample_hz);
}
double Column::sample_m() const { return static_cast<double>(front.sound_mps) / 2 / static_cast<double>(front.sample_hz); }

std::optional<Bathymetry> read_bathymetry(BytesView packet) {
  const auto body = body_of(packet, Type::bathymetry);
  if (!body) return std::nullopt;
  Bathymetry read;
  wire::Reader reader(*body);
  fields(reader, read.front);
  if (!reader.ok() || reader.remaining() != beam_size * read.front.beams) return std::nullopt;
  read.beams.resize(read.front.beams);
  for (Beam& beam : read.beams) fields(reader, beam);
  return read;
}

std::optional<Column> read_column(BytesView packet) {
  const auto body = body_of(packet, Type::column);
  if (!body) return std::nullopt;
  Column read;
  wire::Reader reader(*body);
  fields(reader, read.front);
  const std::size_t pixels = pixel_size * std::size_t{read.front.beams} * read.front.samples;
  if (!reader.ok() || (read.front.pixels != PixelType::uint16 && read.front.pixels != PixelType::int16) ||
      read.front.beams > 1024 || reader.remaining() != pixels + sizeof(float) * read.front.beams)
    return std::nullopt;
  read.pixels = reader.block("pixels", pixels);
  read.directions = reader.block("directions", reader.remaining());
  return read;
}

void reseal(BytesView before, Bytes& packets) {
  constexpr std::size_t crc_at = header_size - 4;
  std::size_t at = 0;
  while (const auto length = length_of(before.subspan(at), recording::Origin::device, false)) {
    if (*length > before.size() - at || packets.size() < at + *length) return;
    const BytesView body = BytesView(packets).subspan(at + header_size, *length - header_size);
    if (const BytesView was = before.subspan(at + header_size, body.size()); !std::equal(was.begin(), was.end(), body.begin())) {
      const std::uint32_t crc = recording::crc32(body);
      for (unsigned b = 0; b < 4; ++b) packets[at + crc_at + b] = static_cast<std::byte>(crc >> (8 * b));
    }
    at += *length;
  }
}

// Locates the fields and regions that faults change. A message is one packet, or both packets of a ping, bathymetry first.
std::optional<protocol::Field> locate(protocol::FieldName name, BytesView packets) {
  if (packets.empty()) return in_packet<ColumnFront>(name, {});  // the packet with the most fields
  const auto header = header_of(packets);
  if (!header) return std::nullopt;
  if (header->type == Type::column) return in_packet<ColumnFront>(name, packets);
  auto found = in_packet<BathymetryFront>(name, packets);
  if (found || packets.size() <= header->size || header->size <= header_size) return found;
  found = in_packet<ColumnFront>(name, packets.subspan(header->size));
  if (found) found->offset += header->size;
  return found;
}

std::optional<Place> locate(protocol::Region region, BytesView packets) {
  using protocol::Region;
  if (packets.empty()) return Place{};
  const auto header = header_of(packets);
  if (!header || header->size <= header_size || header->size > packets.size()) return std::nullopt;
  if (region == Region::header) return Place{0, header_size};
  if (header->type == Type::bathymetry) {
    constexpr std::size_t beams_at = header_size + bathymetry_front_size;
    if (header->size < beams_at) return std::nullopt;
    if (region == Region::metadata) return Place{header_size, bathymetry_front_size};
    if (packets.size() == header->size)
      return region == Region::image ? std::optional(Place{beams_at, header->size - beams_at}) : std::nullopt;
    const auto found = locate(region, packets.subspan(header->size));
    return found ? std::optional(Place{found->first + header->size, found->second}) : std::nullopt;
  }
  constexpr std::size_t pixels_at = header_size + column_front_size;
  const auto beams = wire::locate<ColumnFront>(means::beams, packets, header_size);
  if (!beams || header->size < pixels_at) return std::nullopt;
  if (region == Region::metadata) return Place{header_size, column_front_size};
  std::uint32_t count = 0;
  wire::Reader reader(packets.subspan(beams->offset));
  reader("N", count);
  const std::size_t directions = sizeof(float) * std::size_t{count};
  if (directions > header->size - pixels_at) return std::nullopt;
  return region == Region::bearings ? Place{header->size - directions, directions}
                                    : Place{pixels_at, header->size - directions - pixels_at};
}

}  // namespace sonar::norbit
