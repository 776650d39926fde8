// The commands of sonarctl, one function each; command_line.hpp fills the options from the command line. Results go to standard
// output, errors are returned as one sentence with the ErrorKind that determines the exit code.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/ping_stream.hpp"
#include "core/base/result.hpp"
#include "core/image/draw_fan.hpp"
#include "core/image/terminal_fan.hpp"
#include "protocol/control/pose_sample.hpp"

namespace sonar::clients {

/// The source of pings: a device or a recording.
struct SourceOptions {
  Endpoint device{"127.0.0.2", 0};  // port 0: the make's port
  const Make* make = nullptr;       // null: that of the port, or the first make that answers at the host of `device`
  bool discover = false;            // use the address in the status broadcast of the device
  std::filesystem::path recording;  // instead of a device
  std::string sonar;                // selects one of several sonars in a recording
  Wanted wanted;
  double connect_patience_s = 2;
  double silence_limit_s = 10;  // limit of the time without a byte
  double return_limit_s = 60;   // limit of the wait for a new connection, in runs without a limit of time or pings
  // Limit of the wait for a picture of many pings, from the first ping on; enough for a Ping360 to scan 180 degrees.
  double picture_limit_s = 30;
  bool observe = false;         // occupy no client slot, request nothing
  bool keeps_messages = false;  // fill PingStream::Item::messages
  std::string control;  // HOST:PORT of sonard's control stream, which reports the address for observers; empty = the default
  std::filesystem::path token_file;
};

struct ListenOptions {
  SourceOptions source;
  double seconds = 0;       // 0 = no limit
  std::uint64_t pings = 0;  // 0 = no limit
  bool json = false, quiet = false;
  double started_at_unix_s = 0;  // if set, the time from then to the first ping is also reported
  std::filesystem::path png;     // draw the last ping
  std::filesystem::path record;  // raw bytes
  FanStyle style;
};
Result<void> listen(const ListenOptions& options);

struct ViewOptions {
  SourceOptions source;
  std::filesystem::path png;               // write the picture to this file
  bool terminal = false;                   // print the picture as text
  bool live = false;                       // show each ping until interrupted, or until `pings` are shown
  std::uint64_t pings = 0;                 // 0 = no limit
  std::optional<TerminalColours> colours;  // nullopt = what the terminal supports
  std::optional<std::size_t> ping;         // index of the ping in the recording, from 0; nullopt: the first complete picture
  FanStyle style;
};
Result<void> view(ViewOptions options);

struct StatsOptions {
  SourceOptions source;
  std::optional<std::size_t> ping;   // as ViewOptions::ping
  std::string window;                // rows and beams of the speckle statistics; empty = all
  std::string shadow, surroundings;  // two windows to compare
  bool json = false;
};
Result<void> stats(const StatsOptions& options);

struct PoseOptions {
  enum class Path { once, circle, line } path = Path::once;
  std::string to;                                  // HOST:PORT; empty = 127.0.0.1 and the protocol's port
  bool json = false;                               // JSON lines instead of protobuf
  bool confirm = false;                            // sends over the TCP control stream, where the daemon answers each pose
  std::filesystem::path token_file;                // for a control stream that requires one
  control::Frame frame = control::Frame::enu_flu;  // frame of the positions and angles below, and of the sent poses
  std::string vehicle, object;                     // at most one is set; none = the only vehicle. Poses of objects use TCP
  double rate_hz = 20, seconds = 0;                // seconds = 0: one pose, one turn or one line
  std::vector<double> position_m{0, 0, 0}, rpy_deg{0, 0, 0};  // for "once"
  std::vector<double> centre_m{0, 0, 0};                      // for "circle"
  double radius_m = 5, period_s = 60;
  bool look_inwards = true;
  std::vector<double> from_m{0, 0, 0}, to_m{10, 0, 0};  // for "line"
  double speed_mps = 0.5;
  double pitch_deg = 0;  // circle and line, bow up positive
};
Result<void> send_poses(const PoseOptions& options);

}  // namespace sonar::clients
