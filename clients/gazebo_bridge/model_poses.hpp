// Converts model poses of a Gazebo world to JSON lines of poses for sonard, for main.cpp. This header does not need Gazebo, so
// tests can use it. The axes are those of sonard (world ENU, bodies FLU), so only formatting and checks are needed.
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/result.hpp"

namespace sonar::clients {

struct FollowedModel {
  std::string model;    // name of the model in Gazebo's world
  std::string vehicle;  // name of the vehicle in sonard; empty = the only one
  std::optional<std::int64_t> last_ns;
};

/// Parses "MODEL" or "MODEL=VEHICLE".
inline Result<FollowedModel> parse_followed(const std::string& text) {
  const std::size_t equals = text.find('=');
  FollowedModel followed{text.substr(0, equals), equals == std::string::npos ? std::string() : text.substr(equals + 1), {}};
  if (followed.model.empty() || (equals != std::string::npos && followed.vehicle.empty()))
    return failure(ErrorKind::usage, "\"" + text + "\" is not MODEL or MODEL=VEHICLE");
  return followed;
}

/// Returns the line of a pose, in ENU and FLU axes, with the simulation's time; nullopt for NaN, infinity, or no rotation.
inline std::optional<std::string> json_line(const Pose& body_in_world, std::int64_t stamp_ns, const std::string& vehicle) {
  const Vec3d& p = body_in_world.position_m;
  const Quatd& q = body_in_world.orientation;
  if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) || !(std::abs(norm_squared(q) - 1) <= 2e-3))
    return std::nullopt;
  nlohmann::json line{{"frame", "ENU_FLU"},
                      {"timestamp", static_cast<double>(stamp_ns) * 1e-9},
                      {"position", {p.x, p.y, p.z}},
                      {"quaternion", {q.w, q.x, q.y, q.z}}};
  if (!vehicle.empty()) line["vehicle"] = vehicle;
  return line.dump() + "\n";
}

/// Returns the lines of one message; `Message` is ignition.msgs.Pose_V, or a type with the same members. If several poses have
/// one name, the first is used, because models precede their links, whose poses are relative to the model. A repeated time is
/// skipped, because Gazebo repeats the last message while paused.
template <class Message>
std::vector<std::string> lines_from(const Message& message, std::vector<FollowedModel>& followed) {
  std::vector<std::string> lines;
  const auto& stamp = message.header().stamp();
  const std::int64_t now_ns = static_cast<std::int64_t>(stamp.sec()) * 1'000'000'000 + stamp.nsec();
  for (FollowedModel& wanted : followed) {
    if (wanted.last_ns == now_ns) continue;
    for (int i = 0; i < message.pose_size(); ++i) {
      const auto& pose = message.pose(i);
      if (pose.name() != wanted.model) continue;
      const auto& p = pose.position();
      const auto& q = pose.orientation();
      if (auto line = json_line({{p.x(), p.y(), p.z()}, {q.w(), q.x(), q.y(), q.z()}}, now_ns, wanted.vehicle)) {
        lines.push_back(*std::move(line));
        wanted.last_ns = now_ns;
      }
      break;
    }
  }
  return lines;
}

}  // namespace sonar::clients
