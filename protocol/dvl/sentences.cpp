#include "protocol/dvl/sentences.hpp"

#include "core/text/format.hpp"

namespace sonar::dvl {
namespace {

using text::format;

const char* yes_or_no(bool yes) { return yes ? "y" : "n"; }

}  // namespace

std::uint8_t crc8(std::string_view text) {
  unsigned crc = 0;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80) != 0 ? (crc << 1 ^ 0x07) & 0xFF : crc << 1;
  }
  return static_cast<std::uint8_t>(crc);
}

Bytes sentence_line(std::string_view sentence) {
  return line_of(std::string(sentence) + format("*%02x", unsigned{crc8(sentence)}));
}

// The order of the lines is assumed.
Bytes velocity_sentences(const Measurement& m, std::chrono::nanoseconds since_last, Time sent_at, SerialOutput output) {
  Bytes lines;
  const auto add = [&lines](const std::string& sentence) {
    const Bytes line = sentence_line(sentence);
    lines.insert(lines.end(), line.begin(), line.end());
  };
  if (output == SerialOutput::none) return lines;
  const Vec3d& v = m.velocity_mps;
  const double since_ms = 1e3 * seconds(since_last);
  if (output == SerialOutput::old_and_new) {
    add(format("wrx,%.2f,%.3f,%.3f,%.3f,%.3f,%.2f,%s,%d", since_ms, v.x, v.y, v.z, m.fom, m.altitude_m, yes_or_no(m.is_valid),
               m.status));
    const auto& b = m.beams;
    add(format("wrt,%.2f,%.2f,%.2f,%.2f", b[0].distance_m, b[1].distance_m, b[2].distance_m, b[3].distance_m));
  }
  std::string covariance;
  for (const auto& row : m.covariance)
    for (const double value : row) covariance += (covariance.empty() ? "" : ";") + format("%g", value);
  add(format("wrz,%.3f,%.3f,%.3f,%s,%.2f,%.3f,%s,%lld,%lld,%.2f,%d", v.x, v.y, v.z, yes_or_no(m.is_valid), m.altitude_m, m.fom,
             covariance.c_str(), static_cast<long long>(microseconds(m.reflected_at)),
             static_cast<long long>(microseconds(sent_at)), since_ms, m.status));
  for (std::size_t i = 0; i < beam_count; ++i)
    add(format("wru,%zu,%.3f,%.2f,%.0f,%.0f", i, m.beams[i].velocity_mps, m.beams[i].distance_m, m.beams[i].rssi_dbm,
               m.beams[i].nsd_dbm));
  return lines;
}

Bytes position_sentence(const Reckoning& r, Time at) {
  const RollPitchYaw angles = angles_of(r);
  const Vec3d& p = r.position_m;
  return sentence_line(format("wrp,%.3f,%.2f,%.2f,%.2f,%.3f,%.1f,%.1f,%.1f,0", 1e-6 * static_cast<double>(microseconds(at)), p.x,
                              p.y, p.z, r.std_m, deg_from_rad(angles.roll_rad), deg_from_rad(angles.pitch_rad),
                              deg_from_rad(angles.yaw_rad)));
}

}  // namespace sonar::dvl
