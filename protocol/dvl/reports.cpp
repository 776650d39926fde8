#include "protocol/dvl/reports.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text/format.hpp"

namespace sonar::dvl {
namespace {

using Json = nlohmann::ordered_json;

Bytes line_of(const Json& message) { return dvl::line_of(message.dump()); }

/// Returns a member of an object; nullopt if it is missing, or is not a finite number below 1e18. Larger numbers could overflow
/// in conversions.
std::optional<double> number(const Json& from, const char* name) {
  const auto found = from.find(name);
  if (found == from.end() || !found->is_number()) return std::nullopt;
  const auto value = found->get<double>();
  return std::isfinite(value) && std::abs(value) < 1e18 ? std::optional(value) : std::nullopt;
}
std::optional<bool> truth(const Json& from, const char* name) {
  const auto found = from.find(name);
  return found != from.end() && found->is_boolean() ? std::optional(found->get<bool>()) : std::nullopt;
}
std::string text(const Json& from, const char* name) {
  const auto found = from.find(name);
  return found != from.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Returns a time in whole microseconds since 1970; Time{} if it is missing, or larger than Time can hold.
Time time_in(const Json& from, const char* name, double unit_us) {
  const double at_us = unit_us * number(from, name).value_or(0);
  return Time(std::chrono::microseconds(std::abs(at_us) < 9e15 ? std::llround(at_us) : 0));
}
Covariance covariance_in(const Json& message) {
  Covariance covariance{};
  const auto rows = message.find("covariance");
  for (std::size_t i = 0; rows != message.end() && rows->is_array() && i < std::min(rows->size(), covariance.size()); ++i)
    for (std::size_t j = 0; (*rows)[i].is_array() && j < std::min((*rows)[i].size(), covariance[i].size()); ++j)
      if ((*rows)[i][j].is_number()) covariance[i][j] = (*rows)[i][j].get<double>();
  return covariance;
}

/// Reads a report. Reports of older software have no times; the time of the ping is then unknown.
std::optional<VelocityReport> velocity_from(const Json& message) {
  const auto vx = number(message, "vx"), vy = number(message, "vy"), vz = number(message, "vz");
  const auto altitude = number(message, "altitude");
  const auto valid = truth(message, "velocity_valid");
  const auto transducers = message.find("transducers");
  if (!vx || !vy || !vz || !altitude || !valid || transducers == message.end() || !transducers->is_array() ||
      transducers->size() != beam_count)
    return std::nullopt;
  VelocityReport report;
  Measurement& m = report.measured;
  m.velocity_mps = {*vx, *vy, *vz};
  m.altitude_m = *altitude;
  m.is_valid = *valid;
  m.fom = number(message, "fom").value_or(0);
  m.covariance = covariance_in(message);
  m.status = static_cast<int>(std::clamp(number(message, "status").value_or(0), 0.0, 255.0));
  m.reflected_at = time_in(message, "time_of_validity", 1);
  report.sent_at = time_in(message, "time_of_transmission", 1);
  report.since_last = time_in(message, "time", 1e3).time_since_epoch();
  for (std::size_t i = 0; i < beam_count; ++i) {
    const Json& beam = (*transducers)[i];
    if (!beam.is_object()) return std::nullopt;
    const auto distance = number(beam, "distance"), rssi = number(beam, "rssi");
    const auto beam_valid = truth(beam, "beam_valid");
    if (!distance || !rssi || !beam_valid) return std::nullopt;
    m.beams[i].is_valid = *beam_valid;
    m.beams[i].velocity_mps = number(beam, "velocity").value_or(0);
    m.beams[i].distance_m = *distance;
    m.beams[i].rssi_dbm = *rssi;
    m.beams[i].nsd_dbm = number(beam, "nsd").value_or(usual_nsd_dbm);
  }
  return report;
}

std::optional<PositionReport> position_from(const Json& message) {
  const auto x = number(message, "x"), y = number(message, "y"), z = number(message, "z");
  const auto roll = number(message, "roll"), pitch = number(message, "pitch"), yaw = number(message, "yaw");
  if (!x || !y || !z || !roll || !pitch || !yaw) return std::nullopt;
  PositionReport report;
  report.at = time_in(message, "ts", 1e6);
  report.reckoning.is_started = true;
  report.reckoning.position_m = {*x, *y, *z};
  report.reckoning.last = quat_from_rpy({rad_from_deg(*roll), rad_from_deg(*pitch), rad_from_deg(*yaw)});
  report.reckoning.std_m = number(message, "std").value_or(0);
  return report;
}

using text::format;

const char* yes_or_no(bool yes) { return yes ? "y" : "n"; }

}  // namespace

std::int64_t microseconds(Time at) {
  return std::chrono::duration_cast<std::chrono::microseconds>(at.time_since_epoch()).count();
}

RollPitchYaw angles_of(const Reckoning& r) { return rpy_from_quat(conjugate(r.first) * r.last); }

Bytes line_of(std::string text) {
  text += line_end;
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

Bytes velocity_line(const Measurement& m, std::chrono::nanoseconds since_last, Time sent_at) {
  Json covariance = Json::array(), transducers = Json::array();
  for (const auto& row : m.covariance) covariance.push_back(row);
  for (std::size_t i = 0; i < beam_count; ++i) {
    const Beam& beam = m.beams[i];
    transducers.push_back({{"id", i},
                           {"velocity", beam.velocity_mps},
                           {"distance", beam.distance_m},
                           {"rssi", beam.rssi_dbm},
                           {"nsd", beam.nsd_dbm},
                           {"beam_valid", beam.is_valid}});
  }
  return line_of({{"time", 1e3 * seconds(since_last)},
                  {"vx", m.velocity_mps.x},
                  {"vy", m.velocity_mps.y},
                  {"vz", m.velocity_mps.z},
                  {"fom", m.fom},
                  {"covariance", std::move(covariance)},
                  {"altitude", m.altitude_m},
                  {"transducers", std::move(transducers)},
                  {"velocity_valid", m.is_valid},
                  {"status", m.status},
                  {"format", format_name},
                  {"type", "velocity"},
                  {"time_of_validity", microseconds(m.reflected_at)},
                  {"time_of_transmission", microseconds(sent_at)}});
}

Bytes position_line(const Reckoning& r, Time at) {
  const RollPitchYaw angles = angles_of(r);
  return line_of({{"ts", 1e-6 * static_cast<double>(microseconds(at))},
                  {"x", r.position_m.x},
                  {"y", r.position_m.y},
                  {"z", r.position_m.z},
                  {"std", r.std_m},
                  {"roll", deg_from_rad(angles.roll_rad)},
                  {"pitch", deg_from_rad(angles.pitch_rad)},
                  {"yaw", deg_from_rad(angles.yaw_rad)},
                  {"type", "position_local"},
                  {"status", 0},
                  {"format", format_name}});
}

Line read_line(BytesView line) {
  std::string received;
  for (const std::byte b : line) received.push_back(static_cast<char>(b));
  const Json message = Json::parse(received, nullptr, false);
  if (!message.is_object()) return {};
  const std::string type = text(message, "type");
  if (type == "velocity") return {.velocity = velocity_from(message)};
  if (type == "position_local") return {.position = position_from(message)};
  if (type == "response") {
    const auto result = message.find("result");
    const Json found = result != message.end() && result->is_object() ? *result : Json::object();
    return {.response =
                Response{text(message, "response_to"), text(message, "error_message"), truth(message, "success").value_or(false),
                         truth(found, "acoustic_enabled"), text(found, "range_mode")}};
  }
  return {};
}

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

// unknown: the order of the lines, which is assumed.
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
