// gazebo_bridge: follows models of a Gazebo world and sends their poses to sonard, as JSON over UDP.
// It is built with SONAR_GAZEBO where Ignition Transport 11 is installed. model_poses.hpp converts the messages.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <ignition/msgs.hh>
#include <ignition/transport.hh>
#include <span>

#include "clients/gazebo_bridge/model_poses.hpp"
#include "clients/sonarctl/net.hpp"
#include "core/base/program_start.hpp"

namespace sonar::clients {
namespace {

struct Options {
  std::string world = "default", topic, to;
  std::vector<std::string> models;
};

/// Only the thread that delivers messages uses this; the main thread waits.
struct Following {
  std::vector<FollowedModel> models;
  Socket socket;
  bool has_received = false, was_refused = false;
  std::size_t sent = 0;

  void on_poses(const ignition::msgs::Pose_V& message) {
    const std::vector<std::string> lines = lines_from(message, models);
    for (const std::string& line : lines) {
      // An error here means that the previous datagram was refused. A restart of sonard must not end the bridge.
      const bool refused = !write_all(socket, std::as_bytes(std::span(line)));
      if (refused && !was_refused)
        std::fprintf(stderr, "gazebo_bridge: sonard does not listen at the address of --to; start it, or correct --to\n");
      was_refused = refused;
    }
    sent += lines.size();
    if (!has_received) report_first(message);
    has_received = true;
  }

  void report_first(const ignition::msgs::Pose_V& message) const {
    std::fprintf(stderr, "gazebo_bridge: %d poses in the first message, %zu of %zu models followed\n", message.pose_size(), sent,
                 models.size());
    if (sent == models.size()) return;
    std::fprintf(stderr, "gazebo_bridge: not every model was found; the message has:");
    for (int i = 0; i < message.pose_size(); ++i) std::fprintf(stderr, " %s", message.pose(i).name().c_str());
    std::fprintf(stderr, "\n");
  }
};

int complain(const Error& error) {
  std::fprintf(stderr, "gazebo_bridge: %s\n", error.text.c_str());
  return exit_code(error.kind);
}

int follow(const Options& options) {
  std::vector<FollowedModel> models;
  for (const std::string& text : options.models) {
    auto followed = parse_followed(text);
    if (!followed) return complain(followed.error());
    models.push_back(*std::move(followed));
  }
  const Result<Endpoint> to = parse_endpoint(options.to, {"127.0.0.1", 14771});
  if (!to) return complain(to.error());
  auto socket = connect_udp(*to);
  if (!socket) return complain(socket.error());

  Following following{std::move(models), *std::move(socket)};
  const std::string topic = options.topic.empty() ? "/world/" + options.world + "/pose/info" : options.topic;
  ignition::transport::Node node;
  std::function<void(const ignition::msgs::Pose_V&)> on_poses = [&](const ignition::msgs::Pose_V& m) { following.on_poses(m); };
  if (!node.Subscribe(topic, on_poses)) return complain({ErrorKind::unavailable, "cannot subscribe to " + topic});
  std::fprintf(stderr, "gazebo_bridge: %s to %s\n", topic.c_str(), text_from(*to).c_str());
  ignition::transport::waitForShutdown();
  node.Unsubscribe(topic);
  std::fprintf(stderr, "gazebo_bridge: %zu pose%s sent\n", following.sent, following.sent == 1 ? "" : "s");
  return 0;
}

int run(int argc, char** argv) {
  CLI::App app("gazebo_bridge: sends the poses of Gazebo's models to sonard");
  Options options;
  app.add_option("model", options.models, "model to follow, MODEL or MODEL=VEHICLE of sonard; one for each vehicle")->required();
  app.add_option("--world", options.world, "name of the world")->capture_default_str();
  app.add_option("--topic", options.topic, "topic of the poses; default /world/WORLD/pose/info");
  app.add_option(
      "--to", options.to,
      "HOST or HOST:PORT where sonard accepts poses as JSON (poses.json in its configuration); default 127.0.0.1:14771");
  CLI11_PARSE(app, argc, argv);
  return follow(options);
}

}  // namespace
}  // namespace sonar::clients

int main(int argc, char** argv) {
  sonar::open_closed_standard_streams();
  if (const auto room = sonar::make_room_for_stacks(); !room) return sonar::clients::complain(room.error());
  return sonar::clients::run(argc, argv);
}
