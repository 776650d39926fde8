// Messages of the live view as protobuf, in Foxglove's schemas (schemas/foxglove.proto) and our own (schemas/view.proto). The
// functions convert plain structs (world ENU, bodies FLU, metres) to bytes.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/image/sonar_picture.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/doctor/judge.hpp"
#include "protocol/foxglove/foxglove_words.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::foxglove {

using wire::Bytes;
using wire::BytesView;

/// Returns the FileDescriptorSet of a message such as "foxglove.RawImage" or "sonar.v1.PingEvent", with all imported files; empty
/// if the program has no message with this name.
Bytes descriptor_set(const std::string& name);
/// Returns the schema of a channel: the descriptor set in base64.
Schema protobuf_schema(const std::string& name);

/// Returns a message of the channel with changed times: the stamps, and our own fields in nanoseconds of the daemon's time.
Bytes with_stamps(const Channel& of, BytesView message, const std::function<Time(Time)>& stamp);

/// A picture. It can share the samples of a ping.
struct Image {
  std::uint32_t width = 0, height = 0;
  std::string encoding;
  std::size_t bytes_per_sample = 1;
  std::shared_ptr<const Bytes> samples;  // [height][width], little-endian
};
/// Makes a picture of the sent samples: row 0 is nearest, column 0 farthest to port. The encoding is mono8, mono16, or for 24 and
/// 32 bits 32FC1 with fractions of `max_code`. `codes`: [rows][beams], little-endian, `bits` = 8, 16, 24 or 32.
Image image_of(std::size_t beams, std::size_t rows, int bits, std::uint32_t max_code, std::shared_ptr<const Bytes> codes);
Image image_of(const std::shared_ptr<const Ping>& ping);
/// Returns the bytes of a foxglove.RawImage before the samples, which are its last field.
Bytes image_head(Time at, const std::string& frame, const Image& image);
Bytes raw_image(Time at, const std::string& frame, const Image& image);  // the whole message

struct Transform {
  Time at{};
  std::string parent, child;
  Pose child_in_parent;
};
Bytes transforms(std::span<const Transform> all);
Bytes pose_in_frame(Time at, const std::string& frame, const Pose& pose);

/// An object of a scene.
struct Model {
  std::string id, frame;
  Pose in_frame;
  std::vector<std::pair<std::string, std::string>> metadata;
  BytesView glb;  // a mesh of type model/gltf-binary
};
struct Lines {
  std::string id, frame;
  std::vector<Vec3d> points;  // two points per line
};
// These functions make a foxglove.SceneUpdate with one entity or deletion. Concatenated updates are one update, because protobuf
// merges repeated fields.
Bytes scene_update(Time at, const Model& model);
Bytes scene_update(Time at, const Lines& lines);
Bytes scene_deletion(Time at, const std::string& id);

enum class Severity { debug = 1, info, warning, error };
Bytes log_line(Time at, Severity severity, const std::string& message, const std::string& name);

struct CloudPoint {
  float x = 0, y = 0, z = 0;
  std::uint8_t intensity = 0;
};
Bytes cloud(Time at, const std::string& frame, std::span<const CloudPoint> points);

/// Makes a sonar.v1.PingGeometry. Pass `number` = 0 to compare the geometries of different pings.
Bytes geometry(const Ping& ping, std::uint32_t number);
/// Makes the sonar.v1.PingTruth of a ping that was made with SimulationSwitches::keep_truth.
Bytes truth(const Ping& ping);
/// Makes a sonar.v1.Picture. `times`: the time marks at the side of a waterfall.
Bytes picture(const SonarPicture& picture, std::span<const TimeMark> times);
/// Makes sonar.v1.Findings.
Bytes findings(std::span<const doctor::Finding> all);

// Figures of a sonar as a ROS 2 message in CDR, the only encoding that PlotJuggler reads over this socket.

inline constexpr std::array<std::string_view, 15> figure_names = {
    "stamp_s", "number", "range_m", "rate_hz", "simulation_ms", "latency_ms", "clients",    "served",
    "dropped", "x",      "y",       "z",       "roll_deg",      "pitch_deg",  "heading_deg"};

/// Returns the schema of sonard_msgs/msg/SonarFigures: one float64 for each of figure_names.
Schema figures_schema();
wire::Bytes figures(const std::array<double, figure_names.size()>& values);
/// Returns the figures with another stamp_s.
wire::Bytes with_stamp(wire::BytesView figures, const std::function<Time(Time)>& stamp);

}  // namespace sonar::foxglove
