#include "protocol/recording/mcap/mcap_json.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace sonar::recording::mcap {
namespace {

/// Shortest text that reads back the same; JSON has no infinities.
template <class T>
std::string number(T value) {
  if constexpr (std::is_floating_point_v<T>)
    if (!std::isfinite(value)) return "0";
  std::array<char, 32> text;
  const auto told = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), told.ptr};
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

std::string timestamp(Time at) {
  const auto since = at.time_since_epoch();
  const auto whole = std::chrono::floor<std::chrono::seconds>(since);
  return std::string("{\"sec\":").append(number(whole.count())).append(",\"nsec\":") + number((since - whole).count()) + "}";
}

std::string pose_text(const Pose& pose) {
  const Vec3d& p = pose.position_m;
  const Quatd& q = pose.orientation;
  std::string text = "{\"position\":{\"x\":";
  text.append(number(p.x)).append(",\"y\":").append(number(p.y)).append(",\"z\":").append(number(p.z));
  text.append("},\"orientation\":{\"x\":").append(number(q.x)).append(",\"y\":").append(number(q.y));
  return text.append(",\"z\":").append(number(q.z)).append(",\"w\":").append(number(q.w)).append("}}");
}

wire::Bytes as_floats(const oculus::DecodedPing& ping) {
  wire::Bytes out;
  wire::Writer writer(out);
  for (std::size_t row = 0; row < ping.rows(); ++row)
    for (std::size_t beam = 0; beam < ping.beams(); ++beam) {
      const auto sample = static_cast<float>(ping.sample(row, beam));
      writer("sample", sample);
    }
  return out;
}

wire::Bytes as_sent(const oculus::DecodedPing& ping) {
  wire::Bytes out;
  for (std::size_t row = 0; row < ping.rows(); ++row) {
    const wire::BytesView samples = ping.row_samples(row);
    out.insert(out.end(), samples.begin(), samples.end());
  }
  return out;
}

}  // namespace

std::string base64(wire::BytesView bytes) {
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    for (unsigned k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[three >> (18 - 6 * k) & 0x3Fu];
  }
  return text;
}

std::string image_json(Time at, const std::string& frame, const oculus::DecodedPing& ping) {
  const std::size_t width = ping.bytes_per_sample();
  const char* const encoding = width == 1 ? "mono8" : width == 2 ? "16UC1" : "32FC1";
  const wire::Bytes samples = width <= 2 ? as_sent(ping) : as_floats(ping);
  std::string text = "{\"timestamp\":";
  text.append(timestamp(at)).append(",\"frame_id\":").append(quoted(frame)).append(",\"width\":").append(number(ping.beams()));
  text.append(",\"height\":").append(number(ping.rows())).append(",\"encoding\":\"").append(encoding).append("\",\"step\":");
  text.append(number(ping.beams() * (width <= 2 ? width : 4)));
  return text.append(",\"data\":\"").append(base64(samples)).append("\"}");
}

std::string pose_json(Time at, const std::string& frame, const Pose& pose) {
  std::string text = "{\"timestamp\":";
  text.append(timestamp(at)).append(",\"frame_id\":").append(quoted(frame));
  return text.append(",\"pose\":").append(pose_text(pose)).append("}");
}

std::string truth_json(const PingTruth& truth) {
  std::string ranges, objects;
  for (const BeamTruth& beam : truth.beams) {
    const bool hit = beam.object != BeamTruth::nothing;
    ranges.append(ranges.empty() ? "" : ",").append(number(hit ? beam.range_m : 0.0f));
    objects.append(objects.empty() ? "" : ",").append(hit ? number(beam.object) : "-1");
  }
  std::string text = "{\"timestamp\":";
  text.append(timestamp(truth.fired_at)).append(",\"ping\":").append(number(truth.ping)).append(",\"sonar_in_world\":");
  text.append(pose_text(truth.sonar_in_world)).append(",\"range_m\":[").append(ranges).append("],\"object\":[").append(objects);
  return text.append("]}");
}

// ---- the schemas

JsonSchema image_schema() {
  return {
      "foxglove.RawImage",
      R"({"title":"foxglove.RawImage","description":"Samples as sent: a row a range, the nearest first; a column a beam, port first",)"
      R"("type":"object","properties":{)"
      R"("timestamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},"frame_id":{"type":"string"},)"
      R"("width":{"type":"integer"},"height":{"type":"integer"},"encoding":{"type":"string"},"step":{"type":"integer"},)"
      R"("data":{"type":"string","contentEncoding":"base64"}}})"};
}

JsonSchema pose_schema() {
  return {
      "foxglove.PoseInFrame",
      R"({"title":"foxglove.PoseInFrame","description":"World ENU, body FLU: x ahead, y to port, z up",)"
      R"("type":"object","properties":{)"
      R"("timestamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},"frame_id":{"type":"string"},"pose":)"
      R"({"type":"object","properties":{"position":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)"
      R"("orientation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}})"};
}

JsonSchema truth_schema() {
  return {
      "sonard.PingTruth",
      R"({"title":"sonard.PingTruth","description":"Where the sonar was, and per beam (port first) range and index of the first object; -1 = none",)"
      R"("type":"object","properties":{)"
      R"("timestamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},"ping":{"type":"integer"},"sonar_in_world":)"
      R"({"type":"object","properties":{"position":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)"
      R"("orientation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},)"
      R"("range_m":{"type":"array","items":{"type":"number"}},"object":{"type":"array","items":{"type":"integer"}}}})"};
}

}  // namespace sonar::recording::mcap
