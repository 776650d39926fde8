#include "clients/sonarctl/pose.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <thread>

#include <nlohmann/json.hpp>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/control_client.hpp"
#include "core/text/format.hpp"
#include "protocol/control/control.hpp"

namespace sonar::clients {
namespace {

/// In FLU, a positive turn about y (port) lowers the bow.
Quatd facing(double yaw_rad, double pitch_up_rad) { return quat_from_rpy({0, -pitch_up_rad, yaw_rad}); }

}  // namespace

Moment on_circle(const Circle& c, double time_s) {
  const double rate = 2 * pi / c.period_s, angle = rate * time_s;
  const Vec3d outwards{std::cos(angle), std::sin(angle), 0};
  const Vec3d velocity = (rate * c.radius_m) * Vec3d{-std::sin(angle), std::cos(angle), 0};
  const double ahead = rate >= 0 ? angle + pi / 2 : angle - pi / 2;
  return {{c.centre_m + c.radius_m * outwards, facing(c.look_inwards ? angle + pi : ahead, c.pitch_rad)}, velocity};
}

Moment on_line(const Line& line, double time_s) {
  const Vec3d way = line.to_m - line.from_m;
  const double distance = length(way), done = std::clamp(line.speed_mps * time_s, 0.0, distance);
  const Vec3d along = distance > 0 ? (1 / distance) * way : Vec3d{1, 0, 0};
  const bool under_way = time_s >= 0 && done < distance;
  return {{line.from_m + done * along, facing(std::atan2(along.y, along.x), line.pitch_rad)},
          (under_way ? line.speed_mps : 0.0) * along};
}

namespace {

using control::Frame;
using control::PoseSample;
using Send = std::function<Result<void>(const PoseSample&)>;

constexpr std::uint16_t protobuf_port = 14770, json_port = 14771;

Vec3d vector_from(const std::vector<double>& xyz) { return {xyz[0], xyz[1], xyz[2]}; }

Vec3d world_from(const std::vector<double>& xyz, Frame frame) {
  const Vec3d v = vector_from(xyz);
  return frame == Frame::ned_frd ? enu_from_ned(v) : v;
}

Moment standing_still(const PoseOptions& options) {
  const Vec3d rpy = vector_from(options.rpy_deg);
  const Quatd given = quat_from_rpy({rad_from_deg(rpy.x), rad_from_deg(rpy.y), rad_from_deg(rpy.z)});
  const Quatd in_enu = options.frame == Frame::ned_frd ? enu_flu_from_ned_frd(given) : given;
  return {{world_from(options.position_m, options.frame), in_enu}, {}};
}

Circle circle_of(const PoseOptions& o) {
  return {world_from(o.centre_m, o.frame), o.radius_m, o.period_s, rad_from_deg(o.pitch_deg), o.look_inwards};
}
Line line_of(const PoseOptions& o) {
  return {world_from(o.from_m, o.frame), world_from(o.to_m, o.frame), o.speed_mps, rad_from_deg(o.pitch_deg)};
}

Moment moment_at(const PoseOptions& options, double time_s) {
  switch (options.path) {
    case PoseOptions::Path::circle:
      return on_circle(circle_of(options), time_s);
    case PoseOptions::Path::line:
      return on_line(line_of(options), time_s);
    case PoseOptions::Path::once:
      break;
  }
  return standing_still(options);
}

double duration_s(const PoseOptions& options) {
  if (options.seconds > 0 || options.path == PoseOptions::Path::once) return options.seconds;
  return options.path == PoseOptions::Path::circle ? std::abs(options.period_s) : line_of(options).duration_s();
}

PoseSample sample_of(const PoseOptions& options, const Moment& moment, std::uint64_t seq) {
  PoseSample sample;
  sample.of = options.object.empty() ? PoseSample::Of::vehicle : PoseSample::Of::object;
  sample.name = options.object.empty() ? options.vehicle : options.object;
  sample.seq = seq;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  sample.stamp = {control::ClockDomain::wall, std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()};
  sample.pose = moment.body_in_world;
  sample.velocity_mps = rotate(conjugate(sample.pose.orientation), moment.velocity_mps);
  sample.sent_in = options.frame;
  return sample;
}

/// Uses the keys of ArduPilot's JSON. Its frame (NED/FRD) is the default, so the line names only the other frame.
std::string json_line(const PoseSample& sample) {
  const bool ned = sample.sent_in == Frame::ned_frd;
  const Pose pose = ned ? enu_flu_from_ned_frd(sample.pose) : sample.pose;  // the conversion is its own inverse
  const Vec3d velocity_enu = rotate(sample.pose.orientation, sample.velocity_mps.value_or(Vec3d{}));
  const Vec3d v = ned ? enu_from_ned(velocity_enu) : velocity_enu;
  nlohmann::json line{{"timestamp", static_cast<double>(sample.stamp.ns) * 1e-9},
                      {"position", {pose.position_m.x, pose.position_m.y, pose.position_m.z}},
                      {"quaternion", {pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z}},
                      {"velocity", {v.x, v.y, v.z}}};
  if (!ned) line["frame"] = "ENU_FLU";
  if (!sample.name.empty()) line["vehicle"] = sample.name;
  return line.dump() + "\n";
}

std::vector<std::byte> bytes_of(const std::string& text) {
  std::vector<std::byte> bytes;
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  return bytes;
}

/// Sends over a connected UDP socket, which reports after the first datagram if no program listens.
Result<void> send_datagram(const Socket& socket, const Endpoint& to, const std::vector<std::byte>& datagram) {
  const tl::unexpected<Error> no_listener =
      failure(ErrorKind::unavailable, "no program listens on udp " + text_from(to) +
                                          ": does sonard run there, and receive poses at this port? (--to HOST:PORT)");
  if (!write_all(socket, datagram)) return no_listener;
  std::array<std::byte, 16> nothing;
  if (read_some(socket, nothing, std::chrono::milliseconds(5)).what == Wait::closed) return no_listener;
  return {};
}

Result<Send> confirmed_sender(const Endpoint& to, const std::filesystem::path& token_file) {
  auto opened = ControlClient::open({text_from(to), token_file});
  if (!opened) return tl::unexpected(opened.error());
  const auto client = std::make_shared<ControlClient>(std::move(*opened));
  return Send([client](const PoseSample& sample) -> Result<void> {
    const auto answer = client->request(sample);
    if (!answer) return tl::unexpected(answer.error());
    return {};
  });
}

Result<Send> datagram_sender(const Endpoint& to, bool json) {
  auto socket = connect_udp(to);
  if (!socket) return tl::unexpected(socket.error());
  auto shared = std::make_shared<Socket>(std::move(*socket));
  return Send([shared, to, json](const PoseSample& sample) {
    return send_datagram(*shared, to, json ? bytes_of(json_line(sample)) : control::encode_pose_datagram(sample));
  });
}

Result<void> check(const PoseOptions& options) {
  if (!options.vehicle.empty() && !options.object.empty())
    return failure(ErrorKind::usage, "give either --vehicle or --object, not both");
  if (options.json && (options.confirm || !options.object.empty()))
    return failure(ErrorKind::usage, "--json is for datagrams about a vehicle; leave out --json, or both --object and --confirm");
  return {};
}

}  // namespace

Result<void> send_poses(const PoseOptions& options) {
  if (Result<void> sound = check(options); !sound) return sound;
  const Result<Endpoint> to = parse_endpoint(options.to, {"127.0.0.1", options.json ? json_port : protobuf_port});
  if (!to) return tl::unexpected(to.error());
  const bool stream = options.confirm || !options.object.empty();
  const Result<Send> send = stream ? confirmed_sender(*to, options.token_file) : datagram_sender(*to, options.json);
  if (!send) return tl::unexpected(send.error());

  const auto start = std::chrono::steady_clock::now();
  std::uint64_t sent = 0;
  for (double time_s = 0; interrupted == 0; time_s = static_cast<double>(sent) / options.rate_hz) {
    std::this_thread::sleep_until(start +
                                  std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(time_s)));
    if (Result<void> done = (*send)(sample_of(options, moment_at(options, time_s), ++sent)); !done)
      return interrupted != 0 ? Result<void>() : done;
    if (time_s >= duration_s(options)) break;
  }
  std::printf("%s sent to %s %s as %s\n", text::counted(sent, "pose").c_str(), stream ? "tcp" : "udp", text_from(*to).c_str(),
              std::string(control::name_of(options.frame)).c_str());
  return {};
}

}  // namespace sonar::clients
