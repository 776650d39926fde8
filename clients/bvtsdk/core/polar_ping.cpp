#include "clients/bvtsdk/core/polar_ping.hpp"

#include <zlib.h>
#include <algorithm>
#include <cmath>

#include "clients/bvtsdk/core/frame.hpp"

namespace sonar::bvt {
namespace {

constexpr std::uint32_t one = 32768;  // the weight 1; its products with 16-bit samples fit in 32 bits

struct Place {
  int low;
  std::uint16_t weight;
};

/// Returns the two of n samples between whose centres `index` lies; beyond the outermost centres, the outermost sample counts.
Place place_of(double index, int n) {
  const double inside = std::clamp(index, 0.0, static_cast<double>(n - 1));
  const int low = std::min(static_cast<int>(inside), n - 2);
  return {low, static_cast<std::uint16_t>(std::lround((inside - low) * one))};
}

std::uint32_t between(std::uint32_t a, std::uint32_t b, std::uint32_t weight) {
  return (a * (one - weight) + b * weight + one / 2) / one;
}

}  // namespace

PolarLookup::PolarLookup(const Key& key) : key_(key) {
  const double beam_deg = (key.fov_max_deg - key.fov_min_deg) / key.beams;
  const double end_m = std::min(key.stop_m, key.start_m + key.bins * key.bin_m * (1 + 1e-6));
  for (int row = 0; row < key.height; ++row) {
    const double ahead_m = (key.origin_row - row) * key.pixel_m;
    if (ahead_m > end_m) continue;
    bool inside_before = false;
    for (int col = 0; col < key.width; ++col) {
      const double starboard_m = (col - key.origin_col) * key.pixel_m;
      const double range_m = std::sqrt(starboard_m * starboard_m + ahead_m * ahead_m);
      bool inside = range_m >= key.start_m && range_m <= end_m;
      double bearing_deg = 0;
      if (inside) {
        bearing_deg = degrees * std::atan2(starboard_m, ahead_m);
        inside = bearing_deg >= key.fov_min_deg && bearing_deg <= key.fov_max_deg;
      }
      if (inside) {
        const Place beam = place_of((bearing_deg - key.fov_min_deg) / beam_deg - 0.5, key.beams);
        const Place bin = place_of((range_m - key.start_m) / key.bin_m - 0.5, key.bins);
        const auto pixel =
            static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(key.width) + static_cast<std::uint32_t>(col);
        if (!inside_before) spans_.push_back({pixel, 0});
        ++spans_.back().count;
        const auto sample = static_cast<std::uint32_t>(beam.low) * static_cast<std::uint32_t>(key.bins);
        entries_.push_back({sample + static_cast<std::uint32_t>(bin.low), bin.weight, beam.weight});
      }
      inside_before = inside;
    }
  }
}

void PolarLookup::apply(const PolarGrid& grid, std::uint16_t* pixels) const {
  const std::uint16_t* const samples = grid.samples;
  const auto next_beam = static_cast<std::size_t>(grid.bins);
  const Entry* entry = entries_.data();
  for (const Span& span : spans_) {
    std::uint16_t* const run = pixels + span.pixel;
    for (std::uint32_t i = 0; i < span.count; ++i) {
      const Entry e = entry[i];
      const std::uint16_t* const s = samples + e.sample;
      const std::uint32_t left = between(s[0], s[1], e.along_range);
      const std::uint32_t right = between(s[next_beam], s[next_beam + 1], e.along_range);
      run[i] = static_cast<std::uint16_t>(between(left, right, e.along_beams));
    }
    entry += span.count;
  }
}

namespace {

constexpr std::uint8_t format_u16 = 1;
constexpr std::size_t deflate_at_best = 1032;  // zlib's bound: no stream inflates to more than 1032 times its size

/// Calls visit(bit, value) for each numeric field of the navigation data, in the order in which the link sends them.
template <class Nav, class Visit>
void numbers_of(Nav& nav, const Visit& visit) {
  visit(nav_time, nav.time_s);
  visit(nav_latitude, nav.latitude_deg);
  visit(nav_longitude, nav.longitude_deg);
  visit(nav_depth, nav.depth_m);
  visit(nav_altitude, nav.altitude_m);
  visit(nav_pitch, nav.pitch_deg);
  visit(nav_roll, nav.roll_deg);
  visit(nav_heading, nav.heading_deg);
  visit(nav_heading_velocity, nav.heading_velocity_mps);
  visit(nav_course, nav.course_deg);
}
constexpr std::uint16_t known_fields = 2 * nav_text - 1;

/// Returns the error in the fields of fixed size; empty if they are valid.
std::string complaint(const PolarPing& p) {
  if (!std::isfinite(p.time_s)) return "its time is not a number";
  if (!(p.start_m >= 0 && p.stop_m > p.start_m && p.stop_m <= 1e6f)) return "its ranges are not 0 <= start < stop <= 1000 km";
  if (!(p.bin_m > 0 && p.bin_m <= 1e6f)) return "its range bin is not between 0 and 1000 km";
  if (p.sound_speed_mps <= 0 || p.sound_speed_mps > 100000) return "its sound speed is not from 1 to 100000 m/s";
  if (!(p.fov_min_deg >= -180 && p.fov_max_deg > p.fov_min_deg && p.fov_max_deg <= 180))
    return "its sector is not -180 <= minimum < maximum <= 180 degrees";
  return {};
}

/// Reads 16-bit samples, little-endian. On little-endian machines gcc turns the loop into a memcpy.
void samples_from(BytesView bytes, std::vector<std::uint16_t>& samples) {
  samples.resize(bytes.size / 2);
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<std::uint16_t>(bytes.data[2 * i] | bytes.data[2 * i + 1] << 8);
}

void samples_from_planes(BytesView bytes, std::vector<std::uint16_t>& samples) {
  const std::size_t n = bytes.size / 2;
  samples.resize(n);
  for (std::size_t i = 0; i < n; ++i) samples[i] = static_cast<std::uint16_t>(bytes.data[i] << 8 | bytes.data[n + i]);
}

Bytes bytes_of(const std::vector<std::uint16_t>& samples, Packing packing) {
  const std::size_t n = samples.size();
  const bool planes = packing == Packing::planes;
  Bytes out(2 * n);
  for (std::size_t i = 0; i < n; ++i) {
    out[planes ? n + i : 2 * i] = static_cast<std::uint8_t>(samples[i]);
    out[planes ? i : 2 * i + 1] = static_cast<std::uint8_t>(samples[i] >> 8);
  }
  return out;
}

/// Inflates exactly `size` bytes. Returns no bytes if the stream is shorter or longer.
Bytes inflated(BytesView body, std::size_t size) {
  if (size > deflate_at_best * body.size + 64) return {};
  Bytes out(size);
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return {};
  stream.next_in = const_cast<Bytef*>(body.data);  // zlib does not write through it
  stream.avail_in = static_cast<uInt>(body.size);
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(size);
  const int end = inflate(&stream, Z_FINISH);
  const bool whole = end == Z_STREAM_END && stream.avail_out == 0 && stream.avail_in == 0;
  inflateEnd(&stream);
  if (!whole) out.clear();
  return out;
}

/// Compresses runs of equal bytes only (Z_RLE): in noise, other repetitions are rare. Returns no bytes on failure.
Bytes deflated(BytesView body) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, MAX_WBITS, MAX_MEM_LEVEL, Z_RLE) != Z_OK) return {};
  Bytes out(deflateBound(&stream, static_cast<uLong>(body.size)));
  stream.next_in = const_cast<Bytef*>(body.data);  // zlib does not write through it
  stream.avail_in = static_cast<uInt>(body.size);
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int end = deflate(&stream, Z_FINISH);
  out.resize(end == Z_STREAM_END ? stream.total_out : 0);
  deflateEnd(&stream);
  return out;
}

constexpr float full_scale = 65535;

using Samples = std::vector<std::uint16_t>;

Samples pooled_bins(const std::uint16_t* samples, std::size_t beams, std::size_t bins, std::size_t pool) {
  const std::size_t whole = bins / pool, out_bins = (bins + pool - 1) / pool;
  Samples out(beams * out_bins);
  for (std::size_t j = 0; j < beams; ++j) {
    const std::uint16_t* const in = samples + j * bins;
    std::uint16_t* const to = out.data() + j * out_bins;
    if (pool == 2)  // the usual case, written so that it is vectorised
      for (std::size_t k = 0; k < whole; ++k) to[k] = std::max(in[2 * k], in[2 * k + 1]);
    else
      for (std::size_t k = 0; k < whole; ++k) to[k] = *std::max_element(in + k * pool, in + (k + 1) * pool);
    if (whole < out_bins) to[whole] = *std::max_element(in + whole * pool, in + bins);
  }
  return out;
}

}  // namespace

void put_nav(Bytes& out, const NavData& nav) {
  const auto present = static_cast<std::uint16_t>(nav.present & known_fields);
  put(out, present);
  numbers_of(nav, [&](NavField bit, const auto& value) {
    if (present & bit) put(out, value);
  });
  if (present & nav_text) put_text(out, nav.text);
}

NavData decode_nav(Reader& reader) {
  NavData nav;
  const auto sent = reader.read<std::uint16_t>();
  if (sent & ~known_fields) reader.fail();
  nav.present = sent;
  numbers_of(nav, [&](NavField bit, auto& value) {
    if ((sent & bit) == 0) return;
    value = reader.read<std::decay_t<decltype(value)>>();
    if (std::isfinite(value)) return;
    value = 0;
    nav.present = static_cast<std::uint16_t>(nav.present & ~bit);
  });
  if (sent & nav_text) nav.text = reader.text();
  if (!reader.ok()) nav = NavData{};
  return nav;
}

std::optional<PolarPing> decode_ping(BytesView payload, std::string* why) {
  const auto refuse = [&](const std::string& what) {
    if (why) *why = "invalid ping: " + what;
    return std::nullopt;
  };
  Reader reader(payload);
  PolarPing p;
  p.head = reader.read<std::int32_t>();
  p.number = reader.read<std::uint32_t>();
  p.time_s = reader.read<double>();
  p.time_zone_s = reader.read<std::int32_t>();
  p.start_m = reader.read<float>();
  p.stop_m = reader.read<float>();
  p.sound_speed_mps = reader.read<std::int32_t>();
  p.fov_min_deg = reader.read<float>();
  p.fov_max_deg = reader.read<float>();
  p.bin_m = reader.read<float>();
  p.beams = reader.read<std::uint16_t>();
  p.bins = reader.read<std::uint16_t>();
  const auto format = reader.read<std::uint8_t>();
  const auto packing = static_cast<Packing>(reader.read<std::uint8_t>());
  p.nav = decode_nav(reader);
  const std::size_t size = reader.read<std::uint32_t>();
  if (!reader.ok()) return refuse("it ends early or has unknown navigation fields");
  const BytesView body = reader.rest();
  if (const std::string what = complaint(p); !what.empty()) return refuse(what);
  if (format != format_u16) return refuse("its samples have format " + std::to_string(format) + ", only 1 is known");
  const std::size_t expected = 2 * static_cast<std::size_t>(p.beams) * static_cast<std::size_t>(p.bins);
  if (size != expected || size > longest_payload)
    return refuse("it announces " + std::to_string(size) + " bytes of samples; " + std::to_string(p.beams) + " beams x " +
                  std::to_string(p.bins) + " bins need " + std::to_string(expected) + ", and the limit is " +
                  std::to_string(longest_payload));
  if (packing == Packing::plain) {
    if (body.size != size) return refuse(std::to_string(body.size) + " bytes follow, " + std::to_string(size) + " are announced");
    samples_from(body, p.samples);
  } else if (packing == Packing::deflate || packing == Packing::planes) {
    const Bytes samples = inflated(body, size);
    if (samples.size() != size || size == 0) return refuse("its zlib stream is damaged, or does not hold what is announced");
    packing == Packing::planes ? samples_from_planes(samples, p.samples) : samples_from(samples, p.samples);
  } else {
    return refuse("unknown compression " + std::to_string(static_cast<int>(packing)));
  }
  return p;
}

Bytes encode_ping(const PolarPing& ping, Packing packing) {
  const std::size_t size = 2 * ping.samples.size();
  Bytes body;
  if (packing != Packing::plain && size > 0) body = deflated(bytes_of(ping.samples, packing));
  if (body.empty()) {
    packing = Packing::plain;
    body = bytes_of(ping.samples, packing);
  }
  Bytes out;
  out.reserve(256 + ping.nav.text.size() + body.size());
  put(out, ping.head);
  put(out, ping.number);
  put(out, ping.time_s);
  put(out, ping.time_zone_s);
  put(out, ping.start_m);
  put(out, ping.stop_m);
  put(out, ping.sound_speed_mps);
  put(out, ping.fov_min_deg);
  put(out, ping.fov_max_deg);
  put(out, ping.bin_m);
  put(out, static_cast<std::uint16_t>(ping.beams));
  put(out, static_cast<std::uint16_t>(ping.bins));
  put(out, format_u16);
  put(out, static_cast<std::uint8_t>(packing));
  put_nav(out, ping.nav);
  put(out, static_cast<std::uint32_t>(size));
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

double range_scale(const PolarPing& ping, int sound_speed_override_mps) {
  return sound_speed_override_mps > 0 ? static_cast<double>(sound_speed_override_mps) / ping.sound_speed_mps : 1.0;
}

std::uint16_t lowest_significant(float noise_threshold) {
  if (!(noise_threshold > 0)) return 0;
  return static_cast<std::uint16_t>(std::ceil(std::min(noise_threshold, 1.0f) * full_scale));
}

SampleGrid::SampleGrid(const PolarPing& ping, float noise_threshold, float clipping_threshold, int pool) {
  auto beams = static_cast<std::size_t>(ping.beams), bins = static_cast<std::size_t>(ping.bins);
  const std::uint16_t* samples = ping.samples.data();
  // Samples are pooled before the thresholds apply. The result is the same, and the thresholds apply to fewer samples.
  const std::size_t together = std::min(bins, static_cast<std::size_t>(std::max(pool, 1)));
  if (together > 1) {
    made_ = pooled_bins(samples, beams, bins, together);
    bins = made_.size() / beams;
    samples = made_.data();
    pooled_ = static_cast<double>(together);
  }
  const std::uint16_t lowest = lowest_significant(noise_threshold);
  const bool clips = clipping_threshold > 0 && clipping_threshold < 1;
  const auto highest = static_cast<std::uint16_t>(clips ? std::lround(clipping_threshold * full_scale) : 65535);
  if (lowest > 0 || clips) {
    made_.resize(beams * bins);
    std::transform(samples, samples + beams * bins, made_.begin(),
                   [=](std::uint16_t v) { return std::min(v < lowest ? std::uint16_t{0} : v, highest); });
    samples = made_.data();
  }
  if (bins == 1) {  // each sample appears twice, half as long
    Samples twice(2 * beams);
    for (std::size_t j = 0; j < beams; ++j) twice[2 * j] = twice[2 * j + 1] = samples[j];
    made_ = std::move(twice);
    samples = made_.data();
    bins = 2;
    pooled_ *= 0.5;
  }
  if (beams == 1) {  // the beam appears twice, half as wide
    Samples twice(samples, samples + bins);
    twice.insert(twice.end(), samples, samples + bins);
    made_ = std::move(twice);
    samples = made_.data();
    beams = 2;
  }
  view_ = {samples, static_cast<int>(beams), static_cast<int>(bins)};
}

}  // namespace sonar::bvt
