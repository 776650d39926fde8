#include "protocol/recording/mcap/mcap_json.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <set>

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

/// Rows by range, little-endian, of `width` bytes a sample.
struct Picture {
  std::size_t beams = 0, rows = 0, width = 1;
  wire::Bytes samples;
};

Picture picture_of(const oculus::DecodedPing& ping) {
  Picture picture{ping.beams(), ping.rows(), ping.bytes_per_sample(), {}};
  for (std::size_t row = 0; row < ping.rows(); ++row) {
    const wire::BytesView samples = ping.row_samples(row);
    picture.samples.insert(picture.samples.end(), samples.begin(), samples.end());
  }
  return picture;
}

Picture picture_of(const Ping& ping) {
  const PingSettings& s = ping.request.settings;
  return {static_cast<std::size_t>(s.beam_count), static_cast<std::size_t>(s.range_bin_count),
          static_cast<std::size_t>(s.format.bits / 8), ping.samples};
}

wire::Bytes as_floats(const Picture& picture) {
  wire::Bytes out;
  wire::Writer writer(out);
  for (std::size_t at = 0; at + picture.width <= picture.samples.size(); at += picture.width) {
    std::uint32_t value = 0;
    for (std::size_t i = picture.width; i-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(picture.samples[at + i]);
    const auto sample = static_cast<float>(value);
    writer("sample", sample);
  }
  return out;
}

std::string image_text(Time at, const std::string& frame, const Picture& picture) {
  const std::size_t width = picture.width;
  const char* const encoding = width == 1 ? "mono8" : width == 2 ? "16UC1" : "32FC1";
  std::string text = "{\"timestamp\":";
  text.append(timestamp(at)).append(",\"frame_id\":").append(quoted(frame)).append(",\"width\":").append(number(picture.beams));
  text.append(",\"height\":").append(number(picture.rows)).append(",\"encoding\":\"").append(encoding).append("\",\"step\":");
  text.append(number(picture.beams * (width <= 2 ? width : 4)));
  return text.append(",\"data\":\"").append(base64(width <= 2 ? picture.samples : as_floats(picture))).append("\"}");
}

/// The objects that a beam met, each once.
std::string objects_met(const PingTruth& truth) {
  std::set<std::uint32_t> met;
  for (const BeamTruth& beam : truth.beams)
    if (truth.names != nullptr && beam.object < truth.names->objects.size()) met.insert(beam.object);
  std::string text;
  for (const std::uint32_t object : met)
    text.append(text.empty() ? "" : ",").append("{\"index\":").append(number(object)).append(",\"name\":") +=
        quoted(truth.names->objects[object]) + "}";
  return text;
}

std::string bodies_there(const PingTruth& truth) {
  std::string text;
  for (std::size_t i = 0; truth.names != nullptr && i < truth.names->bodies.size() && i < truth.bodies_in_world.size(); ++i)
    text.append(text.empty() ? "" : ",").append("{\"name\":").append(quoted(truth.names->bodies[i])).append(",\"pose\":") +=
        pose_text(truth.bodies_in_world[i]) + "}";
  return text;
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
  return image_text(at, frame, picture_of(ping));
}

std::string image_json(Time at, const std::string& frame, const Ping& ping) { return image_text(at, frame, picture_of(ping)); }

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
  text.append("],\"objects\":[").append(objects_met(truth)).append("],\"bodies\":[").append(bodies_there(truth));
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
      R"({"title":"sonard.PingTruth","description":"Where the sonar and what moves were, and per beam (port first) range and index of the first object; -1 = none",)"
      R"("type":"object","properties":{)"
      R"("timestamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},"ping":{"type":"integer"},"sonar_in_world":)"
      R"({"type":"object","properties":{"position":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)"
      R"("orientation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},)"
      R"("range_m":{"type":"array","items":{"type":"number"}},"object":{"type":"array","items":{"type":"integer"}},"objects":{"type":"array","items":{"type":"object","properties":)"
      R"({"index":{"type":"integer"},"name":{"type":"string"}}}},"bodies":{"type":"array","items":{"type":"object","properties":)"
      R"({"name":{"type":"string"},"pose":{"type":"object","properties":{"position":{"type":"object","properties":)"
      R"({"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},"orientation":{"type":"object","properties":)"
      R"({"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}}}}})"};
}

}  // namespace sonar::recording::mcap
